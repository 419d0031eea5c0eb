"""The entries of one gallery are enrolled in another, each once, as they are."""

import json

import pytest
from made_prints import changed, entries_of, entry_of, refused, scattered

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


def contents(gallery):
    """Return all of a gallery but the numbers."""
    about = [(e.label, e.source, e.content, e.dpi, e.minutiae) for e in gallery.entries()]
    return [*about, *(packed for _, packed in gallery.packed_templates())]


def test_all_is_copied_on_either_database_and_a_stopped_run_continues(source, where, monkeypatch):
    monkeypatch.setattr(enrol, "PRINTS_PER_COMMIT", 3)
    shown = []

    def stop(_, *counts):
        shown.append(counts)
        if counts[0] == 6:
            raise KeyboardInterrupt

    with open_gallery(source) as given, open_gallery(where, create=True) as gallery:
        with pytest.raises(KeyboardInterrupt):
            enrol_gallery(gallery, given, progress=stop)
        assert shown == [(0, 7), (3, 7), (6, 7)]
        done = enrol_gallery(gallery, given)
        assert (done.enrolled, done.known, done.failures) == (1, 6, [])
        assert contents(gallery) == contents(given)


def test_conflicts_and_damage_are_failures(source, tmp_path, run):
    changed(source, "UPDATE fpmatch_entry SET template = zeroblob(50) WHERE id = 3")
    target = tmp_path / "g.db"
    with open_gallery(target, create=True) as gallery:
        gallery.add([entry_of(90, label=Label("5"))])
    result = run("enrol", target, source, "--json")
    document = json.loads(result.stdout)
    assert result.exit_code == 1
    assert (document["enrolled"], document["known"], document["failed"]) == (COUNT - 2, 0, 2)
    reasons = {failure["source"]: failure["reason"] for failure in document["failures"]}
    assert "another picture is enrolled as 5" in reasons["/prints/5_1.tif"]
    why = "damaged: its label, picture or template is not what was enrolled"
    assert reasons[f"{source}: entry 3"] == why
    with open_gallery(target) as gallery:
        assert {failure.source for failure in gallery.failures()} == reasons.keys()


def test_an_encrypted_gallery_is_opened_and_encrypted_again(source, tmp_path, run):
    key = f"file:{tmp_path / 'keys.txt'}"
    make_keys(key)
    sealed, copy = tmp_path / "sealed.db", tmp_path / "copy.db"
    assert run("enrol", sealed, source, "--encrypt", "--key", key).exit_code == 0
    assert run("enrol", copy, sealed, "--key", key).exit_code == 0
    with open_gallery(source) as plain, open_gallery(sealed, key=key) as encrypted:
        assert encrypted.sealing() is not None
        assert contents(encrypted) == contents(plain)
    with open_gallery(source) as plain, open_gallery(copy) as copied:
        assert contents(copied) == contents(plain)
    result = run("enrol", tmp_path / "c.db", sealed)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)


def test_a_gallery_is_not_enrolled_in_itself(source, tmp_path):
    link = tmp_path / "link.db"
    link.hardlink_to(source)
    with open_gallery(source) as one, open_gallery(link) as other:
        refused(enrol_gallery, one, one, code="same gallery")
        refused(enrol_gallery, one, other, code="same gallery")
