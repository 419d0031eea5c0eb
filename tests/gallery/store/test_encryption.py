"""Encrypted galleries: the same results as plain ones, nothing readable, every change detected."""

import pytest
from made_prints import changed, entries_of, entry_of, readable, refused, scattered

from fpmatch.errors import EncryptionError, GalleryError
from fpmatch.gallery.encryption.keys import load_keys, make_keys
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.search import Search

PRINTS = [scattered(seed, 30) for seed in range(12)]
pytestmark = pytest.mark.usefixtures("source")


@pytest.fixture
def encrypted(tmp_path, source):
    """Return the file of an encrypted gallery of `PRINTS`."""
    return filled(tmp_path / "g.db", encrypt=True)


def searched(path, probe=PRINTS[3]):
    with open_gallery(path) as gallery:
        found = identify(Search(gallery, engine=serial()), probe, count=20)
    return [(c.number, c.similarity, c.score) for c in found.candidates]


def test_results_are_those_of_a_plain_gallery_to_the_last_bit(encrypted, tmp_path):
    before = searched(encrypted)
    assert not any(readable(tmp_path, template) for template in PRINTS)
    plain = filled(tmp_path / "plain.db", encrypt=False)
    assert before == searched(plain)
    with pytest.raises(GalleryError, match="gallery rewrite --encrypt"):
        open_gallery(plain, encrypt=True)
    with open_gallery(encrypted) as one, open_gallery(plain) as other:
        assert list(one.templates()) == list(other.templates())
        assert list(one.packed_templates()) == list(other.packed_templates())
        assert list(one.entries()) == list(other.entries())


def test_without_the_key_one_line_names_it(encrypted, source, monkeypatch):
    key_id = load_keys(source).current.id
    monkeypatch.delenv("FPMATCH_KEY")
    with open_gallery(encrypted) as gallery:
        for call in (
            lambda: gallery.template(1),
            lambda: gallery.entry(1),
            lambda: list(gallery.templates()),
            lambda: gallery.add([entry_of(99)]),
            lambda: Search(gallery, engine=serial()),
            gallery.check_keys,
        ):
            assert str(refused(call, code="missing key")) == (
                f"{encrypted}: encrypted with key {key_id}; give it with FPMATCH_KEY, or "
                "--key where the command has it"
            )
        assert len(list(gallery.entries())) == len(PRINTS)  # labels are not encrypted
        assert gallery.remove([1]) == 1
    with pytest.raises(EncryptionError, match="no key was given"):
        open_gallery(encrypted.with_name("new.db"), create=True, encrypt=True)
    assert not encrypted.with_name("new.db").exists()


def test_a_key_may_be_given_to_the_call(encrypted, source, monkeypatch, tmp_path):
    ring, other = load_keys(source), f"file:{tmp_path / 'other'}"
    other_id = make_keys(other).current.id
    monkeypatch.delenv("FPMATCH_KEY")
    for key in (source, ring):
        with open_gallery(encrypted, key=key) as gallery:
            assert len(list(gallery.templates())) == len(PRINTS)
            assert source not in repr(gallery)
    with open_gallery(encrypted, key=other) as gallery:
        why = str(refused(gallery.template, 1, code="missing key"))
        assert ring.current.id in why
        assert other_id in why


def filled(path, *, encrypt):
    with open_gallery(path, create=True, encrypt=encrypt) as gallery:
        gallery.add(entries_of(*PRINTS))
    return path


kinds = pytest.mark.parametrize("encrypt", [False, True], ids=["plain", "encrypted"])
OTHER = "(SELECT {} FROM fpmatch_entry WHERE id = 3)"
CHANGES = {
    **dict.fromkeys(("subject", "finger", "impression", "source"), "'x'"),
    **{"content": "x'07'", "dpi": "501", "minutiae": "minutiae + 1"},
    **{name: OTHER.format(name) for name in ("template", "digest")},
}


@kinds
@pytest.mark.parametrize("column", CHANGES)
def test_a_changed_or_moved_column_is_damage_of_one_entry(tmp_path, encrypt, column):
    path = filled(tmp_path / "g.db", encrypt=encrypt)
    before = searched(path)
    changed(path, f"UPDATE fpmatch_entry SET {column} = {CHANGES[column]} WHERE id = 2")
    with open_gallery(path) as gallery:
        assert len(list(gallery.packed_templates())) == len(PRINTS) - 1
        assert list(gallery.damaged) == [2]
        refused(gallery.template, 2, code="damaged")
        assert "entry 2" in str(refused(gallery.entry, 2, code="damaged"))
    assert [c for c in searched(path) if c[0] != 2] == [c for c in before if c[0] != 2]


@pytest.mark.parametrize("keys", ["", "g" * 16, "\x1b[2J", b"\xff", None, 3])
def test_damaged_keys_in_use_are_one_error(encrypted, keys):
    changed(encrypted, "CREATE TABLE other (id, gallery, keys)")
    changed(encrypted, "INSERT INTO other VALUES (1, ?, ?)", bytes(16), keys)
    changed(encrypted, "DROP TABLE fpmatch_encryption")
    refused(open_gallery, encrypted, code="database")
    changed(encrypted, "ALTER TABLE other RENAME TO fpmatch_encryption")
    with pytest.raises(GalleryError, match="the key in use is missing"):
        open_gallery(encrypted)


def test_an_encrypted_gallery_that_states_it_is_plain_shows_nothing(encrypted):
    changed(encrypted, "UPDATE fpmatch_gallery SET version = 3")
    with open_gallery(encrypted) as gallery:
        assert list(gallery.templates()) == []
        assert len(gallery.damaged) == len(PRINTS)
