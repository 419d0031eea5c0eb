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


def test_commands_are_events(gallery, run, tmp_path, monkeypatch):
    monkeypatch.setenv(OPERATOR, "grace")
    out = str(tmp_path / "out")
    for words in (
        ("gallery", "list", gallery, "--subject", "101"),
        ("extract", "--gallery", gallery, "-o", out),
        ("gallery", "check", gallery),
        ("gallery", "remove", gallery, "1"),
    ):
        assert run(*words).exit_code == 0
    found = run("gallery", "audit", "show", gallery, "--json")
    assert actions(found)[3:] == ["list", "export", "check", "remove"]
    assert json.loads(found.stdout)[3]["client"].startswith("grace (")
    text = run("gallery", "audit", "show", gallery).stdout
    assert len(text.splitlines()) == 7
    assert "previous" not in text


def test_an_audit_is_verified(gallery, run):
    with open_gallery(gallery) as opened:
        state = check_audit(opened)
    told = f"3 events, last hash {state.last}\n"
    assert run("gallery", "audit", "verify", gallery).stdout == told
    expected = ("--expect", state.events, state.last)
    document = json.loads(run("gallery", "audit", "verify", gallery, "--json", *expected).stdout)
    assert document == {"events": 3, "last": state.last}
    run("gallery", "remove", gallery, "1")
    assert run("gallery", "audit", "verify", gallery, *expected).exit_code == 0
    assert run("gallery", "audit", "verify", gallery, "--expect", 3, "00").exit_code == 2


def test_it_ends_where_it_is_switched_off(gallery, run):
    assert run("gallery", "audit", "switch", gallery, "off").exit_code == 0
    assert "as it was before" in run("gallery", "audit", "switch", gallery, "off").stdout
    run("gallery", "remove", gallery, "1")
    assert actions(run("gallery", "audit", "show", gallery, "--json"))[-1] == "audit off"
    assert run("gallery", "audit", "verify", gallery).exit_code == 0


def test_enrol_turns_it_on_and_searches_are_events(run, tmp_path, prints):
    where = str(tmp_path / "own.db")
    result = run("enrol", where, prints / "1_1.png", "--audit", "--workers", "1")
    assert result.exit_code == 0, result.stderr
    assert actions(run("gallery", "audit", "show", where, "--json")) == ["audit on", "enrol"]
    probe = prints / "1_2.png"
    assert run("identify", where, probe, "--workers", "1").exit_code == 0
    assert run("verify", "--gallery", where, "--subject", "1", probe).exit_code == 0
    found = json.loads(run("gallery", "audit", "show", where, "--json").stdout)[2:]
    assert [event["action"] for event in found] == ["identify", "verify"]
    assert found[0]["probe"] == hashlib.sha256(probe.read_bytes()).hexdigest()
    assert found[0]["candidates"] == [1]
    assert (found[1]["subject"], found[1]["best"], found[1]["match"]) == ("1", 1, True)


def test_a_gallery_without_and_a_file_that_is_none(run, tmp_path):
    with open_gallery(tmp_path / "plain.db", create=True):
        pass
    result = run("gallery", "audit", "show", str(tmp_path / "plain.db"))
    assert result.exit_code == 2
    assert "gallery audit switch GALLERY on" in result.stderr
    for name in ("missing.db", "."):
        for words in (("show",), ("verify",)):
            result = run("gallery", "audit", *words, str(tmp_path / name))
            assert result.exit_code == 2
            assert result.stderr.count("\n") == 1
