"""Digests and sums: rows that were changed, lost, added or exchanged are noticed."""

import shutil
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_prints import changed, entries_of, entry_of, refused, scattered

from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search.entries import identify_entries
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.store import digests

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
