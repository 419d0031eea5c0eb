"""Digests and sums: rows that were changed, lost, added or exchanged are noticed."""

import shutil
from functools import partial
from pathlib import Path

import pytest
import sqlalchemy as sa
from hypothesis import given
from hypothesis import strategies as st
from made_prints import changed, entries_of, entry_of, refused, scattered

from fpmatch.errors import GalleryError
from fpmatch.formats.files import save_template
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search.entries import identify_entries
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.store import digests
from fpmatch.gallery.tasks.rotation import rotate
from fpmatch.gallery.tasks.space import free_space
from fpmatch.gallery.tasks.transfer import enrol_gallery
from tests.conftest import assert_refused

PRINTS = [scattered(seed, 30) for seed in range(6)]
LABELS = [Label(str(k // 2), "", str(k)) for k in range(6)]
COLUMNS = ("subject", "finger", "impression", "source", "content", "dpi", "minutiae", "template")
TRIGGERS = [f"fpmatch_history_{name}" for name in ("insert", "update", "removal", "state")]
LOST = {
    "removed": "DELETE FROM fpmatch_entry WHERE id = 3",
    "all removed": "DELETE FROM fpmatch_entry",
    "added": (
        "INSERT INTO fpmatch_entry (subject, finger, impression, source, content, dpi, minutiae, "
        "digest, template) SELECT 'x', finger, impression, source, x'00', dpi, minutiae, digest, "
        "template FROM fpmatch_entry WHERE id = 3"
    ),
    "other number": "UPDATE fpmatch_entry SET id = 70 WHERE id = 3",
    "no sums": "UPDATE fpmatch_gallery SET sums = NULL",
    "other sums": "UPDATE fpmatch_gallery SET sums = zeroblob(16)",
    "no digest": "UPDATE fpmatch_entry SET digest = NULL WHERE id = 3",
}
kinds = pytest.mark.parametrize("encrypt", [False, True], ids=["plain", "encrypted"])
lost = pytest.mark.parametrize("statement", LOST.values(), ids=LOST)
pytestmark = pytest.mark.usefixtures("source")


def filled(path, *, encrypt=False):
    with open_gallery(path, create=True, encrypt=encrypt) as gallery:
        gallery.add(entries_of(*PRINTS, labels=LABELS))
    return Path(path)


def without_digests(where):
    """Make a gallery as version 0.2 made it."""
    with open_gallery(where) as gallery, gallery.writing() as connection:
        connection.execute(sa.text("ALTER TABLE fpmatch_entry DROP COLUMN digest"))
        connection.execute(sa.text("ALTER TABLE fpmatch_gallery DROP COLUMN sums"))
        connection.execute(sa.text("UPDATE fpmatch_gallery SET version = version - 2"))


def without_triggers(path, *statements):
    """Change a gallery as damage does, of which its history states nothing."""
    ours = [
        row[0]
        for name in TRIGGERS
        for row in changed(path, "SELECT sql FROM sqlite_master WHERE name = ?", name)
    ]
    for statement in (*(f"DROP TRIGGER {name}" for name in TRIGGERS), *statements, *ours):
        changed(path, statement)


def found(path, probe=2):
    """Return the candidates for a probe; no file of prepared prints is used again."""
    shutil.rmtree(path.with_name(f"{path.name}.prepared"), ignore_errors=True)
    return found_again(path, probe)


def found_again(path, probe=2):
    with open_gallery(path) as gallery:
        search = open_search(gallery, engine=serial())
        result, entries = identify_entries(gallery, search, PRINTS[probe], listed="impressions")
    listed = zip(result.candidates, entries, strict=True)
    return sorted((str(entry.label), one.similarity) for one, entry in listed)


def are_right(gallery):
    with gallery.reading() as connection:
        return digests.are_right(connection)


@pytest.mark.parametrize("column", COLUMNS)
def test_a_changed_column_is_damage_of_one_entry(tmp_path, column):
    path = filled(tmp_path / "g.db")
    expected = [one for one in found(path) if one[0] != str(LABELS[2])]
    other = f"SELECT {column} FROM fpmatch_entry WHERE id = 5"
    value = "'x'" if column in {"finger", "impression"} else "x'07'" if column == "content" else ""
    value = value or (f"{column} + 1" if column in {"dpi", "minutiae"} else f"({other})")
    without_triggers(path, f"UPDATE fpmatch_entry SET {column} = {value} WHERE id = 3")
    for search in (found_again, found):
        assert [one[0] for one in search(path)] == [one[0] for one in expected]
    with open_gallery(path) as gallery:
        assert len(list(gallery.templates())) == len(PRINTS) - 1
        assert list(gallery.damaged) == [3]
        assert are_right(gallery)
        gallery.remove([3])
        assert are_right(gallery)


@kinds
@lost
def test_lost_and_added_entries_are_one_line_and_nothing_is_written(
    run, tmp_path, encrypt, statement
):
    path = filled(tmp_path / "g.db", encrypt=encrypt)
    (changed if encrypt else without_triggers)(path, statement)
    save_template(tmp_path / "probe.json", PRINTS[2])
    before = path.read_bytes()
    for words in (["identify", path, tmp_path / "probe.json"], ["gallery", "check", path]):
        assert_refused(run(*words), f"fpmatch: error: {path}: damaged: entries were removed")
    assert path.read_bytes() == before
    assert not list(tmp_path.glob("*.prepared/*"))


@lost
def test_with_prepared_prints_of_before_no_other_candidates_are_found(tmp_path, statement):
    path = filled(tmp_path / "g.db")
    expected = found(path)
    without_triggers(path, statement)
    if statement == LOST["no digest"]:  # which is named
        expected = [one for one in expected if one[0] != str(LABELS[2])]
    try:
        assert found_again(path) == expected
    except GalleryError as error:
        assert error.code == "damaged"  # noqa: PT017


@kinds
def test_subjects_that_were_exchanged_are_damage_of_both(tmp_path, encrypt):
    path = filled(tmp_path / "g.db", encrypt=encrypt)
    expected = [one for one in found(path) if one[0] not in {str(LABELS[0]), str(LABELS[4])}]
    for number, subject in ((1, "-"), (5, LABELS[0].subject), (1, LABELS[4].subject)):
        changed(path, "UPDATE fpmatch_entry SET subject = ? WHERE id = ?", subject, number)
    assert found(path) == found_again(path) == expected


@kinds
def test_an_older_copy_of_an_entry_is_noticed(tmp_path, encrypt):
    path = filled(tmp_path / "g.db", encrypt=encrypt)
    columns = f"{', '.join(COLUMNS)}, digest"
    (old,) = changed(path, f"SELECT {columns} FROM fpmatch_entry WHERE id = 6")
    with open_gallery(path) as gallery:
        gallery.remove([6])
        gallery.add([entry_of(6, scattered(77, 30), LABELS[5])])
    values = ", ".join(f"{name} = ?" for name in columns.split(", "))
    changed(path, f"UPDATE fpmatch_entry SET {values} WHERE id = 7", *old)
    refused(found, path, code="damaged")


def test_what_is_left_can_be_enrolled_in_a_new_gallery(tmp_path):
    path = filled(tmp_path / "g.db")
    changed(path, "DELETE FROM fpmatch_entry WHERE id = 3")
    changed(path, "UPDATE fpmatch_entry SET subject = 'x' WHERE id = 4")
    with open_gallery(path) as source, open_gallery(tmp_path / "new.db", create=True) as gallery:
        done = enrol_gallery(gallery, source)
        assert (done.enrolled, len(done.failures)) == (4, 2)
        assert [one.source for one in done.failures] == [f"{path}: entry 4", str(path)]
        assert "exchanged" in done.failures[1].reason
        assert are_right(gallery)


@kinds
@pytest.mark.parametrize("change", ["add", "remove", "compact", "rotate"])
def test_a_gallery_of_before_is_read_and_gets_digests_with_its_next_change(
    tmp_path, encrypt, change
):
    path = filled(tmp_path / "g.db", encrypt=encrypt)
    expected = found(path)
    without_digests(path)
    assert found(path) == found_again(path) == expected
    changes = {
        "add": lambda gallery: gallery.add([entry_of(99)]),
        "remove": lambda gallery: gallery.remove([6]),
        "compact": free_space,
        "rotate": lambda gallery: rotate(gallery, decrypt=encrypt),
    }
    with open_gallery(path) as other, open_gallery(path) as gallery:
        assert gallery.summary().version == 1 + encrypt
        changes[change](gallery)
        assert gallery.summary().version == 3 + (encrypt != (change == "rotate"))
        assert are_right(gallery)
        assert [t for _, t in other.templates()] == [t for _, t in gallery.templates()]
        other.add([entry_of(98)])  # opened before
        assert are_right(gallery)
    changed(path, "UPDATE fpmatch_entry SET subject = 'x' WHERE id = 1")
    with open_gallery(path) as gallery:
        assert len(list(gallery.templates())) == len(gallery) - 1


def test_a_gallery_with_digests_that_states_an_older_version_is_damaged(tmp_path):
    path = filled(tmp_path / "g.db")
    for version in (1, 2):
        changed(path, "UPDATE fpmatch_gallery SET version = ?", version)
        refused(open_gallery, path, code="damaged")


def test_who_reads_a_gallery_of_before_does_not_stop_an_enrolment(where):
    filled(where)
    without_digests(where)
    if where.startswith("postgresql"):
        with open_gallery(where) as other, other.reading() as connection:
            connection.execute(sa.text("SELECT * FROM fpmatch_gallery"))
            with open_gallery(where) as gallery:
                assert gallery.add([entry_of(98)]) == [None]
                assert gallery.summary().version == 1
    with open_gallery(where) as gallery:
        gallery.add([entry_of(99)])
        assert gallery.summary().version == 3
        gallery.check_sums()


def test_the_sums_are_right_on_either_database(where):
    with open_gallery(where, create=True) as gallery:
        gallery.add(entries_of(*PRINTS))
        gallery.remove([1, 5])
        rotate(gallery)
        gallery.add([entry_of(50)])
        gallery.check_sums()
        gallery.check_sums(after=5)
        rotate(gallery, decrypt=True)
        gallery.check_sums()
        with gallery.writing() as connection:
            connection.execute(sa.text("DELETE FROM fpmatch_entry WHERE id = 2"))
        refused(gallery.check_sums, code="damaged")


CHANGES = st.lists(st.tuples(st.booleans(), st.integers(0, 9)), max_size=8)


@given(changes=CHANGES)
def test_the_sums_follow_every_change(tmp_path_factory, changes):
    path = tmp_path_factory.mktemp("g") / "g.db"
    with open_gallery(path, create=True) as gallery:
        gallery.add([entry_of(1), entry_of(2)])
        changed(path, "UPDATE sqlite_sequence SET seq = 4080 WHERE name = 'fpmatch_entry'")
        for serial_number, (adds, number) in enumerate(changes, 1):
            numbers = list(gallery.fingers())
            if adds:
                gallery.add([entry_of(10 * serial_number + k) for k in range(number)])
            elif numbers:
                gallery.remove(numbers[number % len(numbers) :: 2])
            gallery.check_sums()
            gallery.check_sums(after=4090)
            gallery.check_sums(of=[1, 5000])
        numbers = list(gallery.fingers())
        if numbers:
            number = numbers[len(numbers) // 2]
            changed(path, "DELETE FROM fpmatch_entry WHERE id = ?", number)
            refused(gallery.check_sums, code="damaged")
            refused(partial(gallery.check_sums, of=[number]), code="damaged")
            gallery.check_sums(of=[number ^ 4096])  # of another block
