"""`fpmatch gallery audit`, `enrol --audit`: what is asked of commands."""

import hashlib
import json

import pytest

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label, NewEntry
from fpmatch.gallery.store.audit import OPERATOR, acting_as, check_audit
from fpmatch.templates.minutiae import Minutiae, Template


@pytest.fixture
def gallery(tmp_path, run):
    """Return a gallery of two prints that keeps an audit."""
    where = str(tmp_path / "prints.db")
    minutiae = Minutiae(x=[10, 20], y=[5, 8], angle=[0, 1.6])
    with open_gallery(where, create=True):
        pass
    assert run("gallery", "audit", "switch", where, "on").exit_code == 0
    with open_gallery(where) as opened, acting_as("ada"):
        for subject in ("101", "102"):
            label = Label(subject, "", "1")
            template = Template(minutiae, 300, 400)
            content = subject.encode().ljust(32)
            opened.add([NewEntry(label, f"/prints/{subject}.png", content, template)])
    return where


def actions(result):
    return [event["action"] for event in json.loads(result.stdout)]


def test_commands_are_events(gallery, run, tmp_path, prints, monkeypatch):
    monkeypatch.setenv(OPERATOR, "grace")
    probe, where = prints / "1_2.png", str(tmp_path / "own.db")
    result = run("enrol", where, prints / "1_1.png", "--audit", "--workers", "1")
    assert result.exit_code == 0, result.stderr
    for words in (
        ("identify", where, probe, "--workers", "1"),
        ("verify", "--gallery", where, "--subject", "1", probe),
        ("gallery", "list", where, "--subject", "101"),
        ("extract", "--gallery", where, "-o", tmp_path / "out"),
        ("gallery", "check", where),
        ("gallery", "remove", where, "1"),
    ):
        assert run(*words).exit_code == 0
    result = run("gallery", "audit", "show", where, "--json")
    assert actions(result) == [
        *("audit on", "enrol", "identify", "verify", "list", "export", "check", "remove")
    ]
    identified, verified = json.loads(result.stdout)[2:4]
    assert identified["client"].startswith("grace (")
    assert identified["probe"] == hashlib.sha256(probe.read_bytes()).hexdigest()
    assert identified["candidates"] == [1]
    assert (verified["subject"], verified["best"], verified["match"]) == ("1", 1, True)
    text = run("gallery", "audit", "show", where).stdout
    assert len(text.splitlines()) == 8
    assert "previous" not in text


def test_an_audit_is_verified_until_it_is_switched_off(gallery, run):
    with open_gallery(gallery) as opened:
        state = check_audit(opened)
    assert run("gallery", "audit", "verify", gallery).stdout == (
        f"3 events, last hash {state.last}\n"
    )
    expected = ("--expect", state.events, state.last)
    document = json.loads(run("gallery", "audit", "verify", gallery, "--json", *expected).stdout)
    assert document == {"events": 3, "last": state.last}
    run("gallery", "remove", gallery, "1")
    assert run("gallery", "audit", "verify", gallery, *expected).exit_code == 0
    assert run("gallery", "audit", "verify", gallery, "--expect", 3, "00").exit_code == 2
    assert run("gallery", "audit", "switch", gallery, "off").exit_code == 0
    assert "as it was before" in run("gallery", "audit", "switch", gallery, "off").stdout
    run("gallery", "remove", gallery, "2")
    assert actions(run("gallery", "audit", "show", gallery, "--json"))[-1] == "audit off"
    assert run("gallery", "audit", "verify", gallery).exit_code == 0


def test_a_gallery_without_and_a_file_that_is_none(run, tmp_path):
    open_gallery(tmp_path / "plain.db", create=True).close()
    for name in ("plain.db", "missing.db", "."):
        for verb in ("show", "verify"):
            result = run("gallery", "audit", verb, tmp_path / name)
            assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
