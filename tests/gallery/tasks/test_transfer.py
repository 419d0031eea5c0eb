"""The entries of one gallery are enrolled in another, each once, as they are."""

import json

import pytest
from click.testing import CliRunner
from made_prints import changed, entries_of, entry_of, refused, scattered

from fpmatch.cli.group import fpmatch
from fpmatch.gallery.encryption.keys import make_keys
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.tasks import enrol
from fpmatch.gallery.tasks.enrol import enrol_gallery

COUNT = 7


@pytest.fixture
def source(tmp_path):
    """Return a gallery of some entries, of which the first number was removed."""
    path = tmp_path / "source.db"
    with open_gallery(path, create=True) as gallery:
        gallery.add(entries_of(*(scattered(k, 9 + k) for k in range(COUNT + 1))))
        gallery.remove([1])
    return path


def run(*words):
    result = CliRunner().invoke(fpmatch, ["enrol", *map(str, words)])
    return result.exit_code, result.stdout, result.stderr


def contents(gallery):
    """Return all of a gallery but the numbers."""
    about = [(e.label, e.source, e.content, e.dpi, e.minutiae) for e in gallery.entries()]
    return [*about, *(packed for _, packed in gallery.packed_templates())]


def test_all_is_copied_on_either_database(source, where, monkeypatch):
    monkeypatch.setattr(enrol, "PRINTS_PER_COMMIT", 3)
    shown = []
    with open_gallery(source) as given, open_gallery(where, create=True) as gallery:
        done = enrol_gallery(gallery, given, progress=lambda _, *counts: shown.append(counts))
        assert (done.enrolled, done.known, done.failures) == (COUNT, 0, [])
        assert contents(gallery) == contents(given)
        again = enrol_gallery(gallery, given)
        assert (again.enrolled, again.known, again.failures) == (0, COUNT, [])
    assert shown == [(0, 7), (3, 7), (6, 7), (7, 7)]


def test_a_run_that_was_stopped_continues(source, tmp_path, monkeypatch):
    monkeypatch.setattr(enrol, "PRINTS_PER_COMMIT", 2)

    def stop(_, done, __):
        if done == 4:
            raise KeyboardInterrupt

    with open_gallery(source) as given, open_gallery(tmp_path / "g.db", create=True) as gallery:
        with pytest.raises(KeyboardInterrupt):
            enrol_gallery(gallery, given, progress=stop)
        assert len(gallery) == 4
        done = enrol_gallery(gallery, given)
        assert (done.enrolled, done.known) == (COUNT - 4, 4)
        assert contents(gallery) == contents(given)


def test_conflicts_and_damage_are_failures(source, tmp_path):
    changed(source, "UPDATE fpmatch_entry SET template = zeroblob(50) WHERE id = 3")
    changed(source, "UPDATE fpmatch_entry SET minutiae = minutiae + 1 WHERE id = 4")
    target = tmp_path / "g.db"
    with open_gallery(target, create=True) as gallery:
        gallery.add([entry_of(90, label=Label("5"))])
    status, out, _ = run(target, source, "--json")
    found = json.loads(out)
    assert status == 1
    assert (found["enrolled"], found["known"], found["failed"]) == (COUNT - 3, 0, 3)
    reasons = {failure["source"]: failure["reason"] for failure in found["failures"]}
    assert "another picture is enrolled as 5" in reasons["/prints/5_1.tif"]
    why = "damaged: its label, picture or template is not what was enrolled"
    assert reasons[f"{source}: entry 3"] == reasons[f"{source}: entry 4"] == why
    with open_gallery(target) as gallery:
        assert {failure.source for failure in gallery.failures()} == reasons.keys()


def test_an_encrypted_gallery_is_opened_and_encrypted_again(tmp_path):
    key = f"file:{tmp_path / 'keys.txt'}"
    make_keys(key)
    with open_gallery(tmp_path / "a.db", create=True, key=key, encrypt=True) as given:
        given.add(entries_of(scattered(1, 30), scattered(2, 30)))
        expected = contents(given)
    assert run(tmp_path / "b.db", tmp_path / "a.db", "--encrypt", "--key", key)[0] == 0
    with open_gallery(tmp_path / "b.db", key=key) as copied:
        assert copied.sealing() is not None
        assert contents(copied) == expected
    status, _, err = run(tmp_path / "c.db", tmp_path / "a.db")
    assert status == 2
    assert "key" in err
    assert len(err.strip().splitlines()) == 1


def test_a_gallery_is_not_enrolled_in_itself(source, tmp_path):
    link = tmp_path / "link.db"
    link.hardlink_to(source)
    for path in (source, link):
        status, _, err = run(source, path)
        assert status == 2
        assert err.strip().endswith("its entries cannot be enrolled in itself")
    with open_gallery(source) as one:
        refused(enrol_gallery, one, one, code="same gallery")


def test_entries_that_match_nothing_of_their_finger_are_named_or_refused(source, tmp_path):
    with open_gallery(source) as given:
        for strict in (False, True):
            with open_gallery(tmp_path / f"{strict}.db", create=True) as gallery:
                gallery.add([entry_of(99, scattered(99, 30), Label("5"))])
                gallery.add([entry_of(98, scattered(98, 30), Label("6", "", "other"))])
                done = enrol_gallery(gallery, given, strict=strict)
                assert (done.enrolled, done.added) == (
                    COUNT - 1 - strict,
                    {} if strict else {"6": 1},
                )
                assert len(done.unmatched) == 1 - strict
