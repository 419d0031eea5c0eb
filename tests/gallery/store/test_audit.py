"""The audit of a gallery: each event is stored with what it states, and cannot be changed."""

import hashlib
from concurrent.futures import ThreadPoolExecutor

import pytest
import sqlalchemy as sa
from made_prints import entry_of, refused

from fpmatch.errors import GalleryError
from fpmatch.gallery.cli.export import export_gallery
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Failure, Label
from fpmatch.gallery.store import audit
from fpmatch.gallery.store.audit import OPERATOR, act_as, check_audit, events_of, switch
from fpmatch.gallery.tasks.api import identify
from fpmatch.templates.minutiae import Minutiae, Template


def entry(subject, impression="1"):
    """Return a print of a subject."""
    content = hashlib.sha256(f"{subject}_{impression}".encode()).digest()
    return entry_of(7, label=Label(subject, "", impression), content=content)


def events(gallery):
    return [event for _, _, event in events_of(gallery)]


@pytest.fixture
def audited(where, monkeypatch):
    monkeypatch.setenv(OPERATOR, "ada")
    with open_gallery(where, create=True) as gallery:
        switch(gallery, on=True)
        yield gallery


def test_changes_are_stored_with_their_events(audited):
    audited.add([entry("101"), entry("101", "2")], [Failure("/pictures/bad.png", "blank")])
    audited.remove([1])
    audited.clear_failures()
    _, enrolled, removed, cleared = events(audited)
    assert all(event["client"].startswith("ada (") for event in (enrolled, removed, cleared))
    assert (enrolled["action"], enrolled["failed"]) == ("enrol", 1)
    assert enrolled["entries"] == [
        {
            "number": k,
            "subject": "101",
            "finger": "",
            "impression": str(k),
            "sha256": hashlib.sha256(f"101_{k}".encode()).hexdigest(),
        }
        for k in (1, 2)
    ]
    assert [one["number"] for one in removed["entries"]] == [1]
    assert (cleared["action"], cleared["count"]) == ("clear failures", 1)
    assert check_audit(audited)[0] == 4


def test_it_is_off_until_it_is_turned_on(where):
    with open_gallery(where, create=True) as gallery:
        gallery.add([entry("101")])
        refused(events, gallery, code="no audit")
        assert switch(gallery, on=True)
        assert not switch(gallery, on=True)
        gallery.add([entry("102")])
        assert switch(gallery, on=False)
        assert not switch(gallery, on=False)
        gallery.remove([2])
        gallery.record("list")
        assert check_audit(gallery)[0] == 3
        assert switch(gallery, on=True)
        assert [event["action"] for event in events(gallery)] == [
            *("audit on", "enrol", "audit off", "audit on")
        ]
        assert check_audit(gallery)[0] == 4  # what was removed meanwhile is not missed


def change(gallery, *statements):
    """Change the database as another program does."""
    with gallery.changing() as connection:
        for one in statements:
            connection.execute(sa.text(one))


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("UPDATE fpmatch_audit SET line = replace(line, 'ada', 'bob') WHERE number = 2", "changed"),
        ("DELETE FROM fpmatch_audit WHERE number = 2", "changed"),
        ("UPDATE fpmatch_audit SET line = 'x' WHERE number = 2", "damaged"),
        ("DELETE FROM fpmatch_audit WHERE number > 2", "unrecorded"),
    ],
)
def test_a_change_is_found(audited, statement, code):
    audited.add([entry("101")])
    audited.add([entry("102")])
    audited.remove([1])
    change(audited, statement)
    error = refused(check_audit, audited, code=code)
    assert error.path == audited.name


def test_a_chain_that_was_written_anew_is_found_by_an_earlier_state(audited):
    audited.add([entry("101")])
    expect = check_audit(audited)
    audited.record("list")
    assert check_audit(audited, expect=expect)[0] == 3
    change(audited, "DELETE FROM fpmatch_audit WHERE number > 1")
    refused(check_audit, audited, expect=expect, code="shortened")
    with audited.changing() as connection:
        audit.record(connection, "enrol", entries=[], failed=0)
    assert check_audit(audited)[0] == 2
    refused(check_audit, audited, expect=expect, code="changed")


SWAP = [
    f"UPDATE fpmatch_entry SET id = {new} WHERE id = {k}" for k, new in ((1, 9), (2, 1), (9, 2))
]


@pytest.mark.parametrize(
    ("statements", "code"),
    [
        (SWAP, "exchanged"),
        (["UPDATE fpmatch_entry SET id = 7 WHERE id = 2"], "missing"),
        (["DELETE FROM fpmatch_entry WHERE id = 2"], "missing"),
        (["UPDATE fpmatch_entry SET id = 3 WHERE id = 2"], "removed"),
        (["UPDATE fpmatch_entry SET subject = 'eve' WHERE id = 2"], "exchanged"),
        (["UPDATE fpmatch_gallery SET state = 'other'"], "unrecorded"),
    ],
)
def test_a_change_of_entries_without_an_event_is_found(audited, run, where, statements, code):
    audited.add([entry("101"), entry("102"), entry("103")])
    audited.remove([3])
    check_audit(audited)
    change(audited, *statements)
    error = refused(check_audit, audited, code=code)
    for words in (("gallery", "audit", "verify", where), ("gallery", "check", where)):
        result = run(*words)
        assert (result.exit_code, str(error) in result.stderr) == (2, True)


def test_what_cannot_be_stored_is_not_done(audited, where, monkeypatch, tmp_path):
    audited.add([entry("101")])

    def fail(*_, **__):
        raise sa.exc.OperationalError("insert", {}, Exception("no space"))

    monkeypatch.setattr(audit, "json_text", fail)
    for change in (
        lambda: audited.add([entry("102")]),
        lambda: audited.remove([1]),
        lambda: audited.record("list"),
        lambda: export_gallery(where, tmp_path / "out", "json", None),
        lambda: identify(audited, Template(Minutiae(x=[1], y=[2], angle=[0]), 300, 400)),
    ):
        with pytest.raises(GalleryError):
            change()
    assert not (tmp_path / "out").exists()
    monkeypatch.undo()
    assert len(audited) == 1
    assert check_audit(audited)[0] == 2


def test_several_programs_share_one_chain(audited, where):
    def enrol(name):
        with open_gallery(where) as own:
            for k in range(5):
                own.add([entry(name, str(k))])
                own.record("list", subject=name)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda name: act_as(name, enrol, name), "abcd"))
    assert check_audit(audited)[0] == 41
    assert len(audited) == 20
