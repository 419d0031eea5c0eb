"""`fpmatch gallery audit`, `enrol --audit`: what is asked of commands."""

import hashlib
import json

import pytest
from made_prints import entry_of

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.store.audit import OPERATOR, check_audit


@pytest.fixture
def gallery(tmp_path, run):
    """Return a gallery of two prints that keeps an audit."""
    where = str(tmp_path / "prints.db")
    open_gallery(where, create=True).close()
    assert run("gallery", "audit", "switch", where, "on").exit_code == 0
    with open_gallery(where) as opened:
        opened.add([entry_of(1)])
        opened.add([entry_of(2)])
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
    assert "score" not in result.stdout
    text = run("gallery", "audit", "show", where).stdout
    assert (len(text.splitlines()), "previous" in text) == (8, False)


def test_an_audit_is_verified_and_switched(gallery, run):
    with open_gallery(gallery) as opened:
        events, last = check_audit(opened)
    assert run("gallery", "audit", "verify", gallery).stdout == f"3 events, last hash {last}\n"
    document = json.loads(run("gallery", "audit", "verify", gallery, "--json").stdout)
    assert document == {"events": 3, "last": last}
    for expected, status in (((events, last), 0), ((3, "00"), 2)):
        result = run("gallery", "audit", "verify", gallery, "--expect", *expected)
        assert result.exit_code == status
    for shown in ("audit off", "audit off, as it was before"):
        assert run("gallery", "audit", "switch", gallery, "off").stdout.endswith(f": {shown}\n")
    assert actions(run("gallery", "audit", "show", gallery, "--json"))[-1] == "audit off"


def test_a_gallery_without_and_a_file_that_is_none(run, tmp_path):
    open_gallery(tmp_path / "plain.db", create=True).close()
    for name in ("plain.db", "missing.db", "."):
        for verb in ("show", "verify"):
            result = run("gallery", "audit", verb, tmp_path / name)
            assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
