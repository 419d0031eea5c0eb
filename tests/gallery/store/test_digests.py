"""Digests: rows that were changed or exchanged are noticed, one by one."""

from pathlib import Path

import pytest
from made_prints import changed, entries_of, scattered

from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search.entries import identify_entries
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.tasks.transfer import enrol_gallery

PRINTS = [scattered(seed, 30) for seed in range(6)]
LABELS = [Label(str(k // 2), "", str(k)) for k in range(6)]
COLUMNS = ("subject", "finger", "impression", "source", "content", "dpi", "minutiae", "template")
kinds = pytest.mark.parametrize("encrypt", [False, True], ids=["plain", "encrypted"])
pytestmark = pytest.mark.usefixtures("source")


def filled(path, *, encrypt=False):
    with open_gallery(path, create=True, encrypt=encrypt) as gallery:
        gallery.add(entries_of(*PRINTS, labels=LABELS))
    return Path(path)


def candidates(path, probe=2):
    with open_gallery(path) as gallery:
        search = open_search(gallery, engine=serial())
        result, entries = identify_entries(gallery, search, PRINTS[probe], listed="impressions")
    listed = zip(result.candidates, entries, strict=True)
    return sorted((str(entry.label), one.similarity) for one, entry in listed)


@pytest.mark.parametrize("column", [*COLUMNS, "digest"])
def test_a_changed_column_is_damage_of_one_entry(tmp_path, column):
    path = filled(tmp_path / "g.db")
    expected = [one for one in candidates(path) if one[0] != str(LABELS[2])]
    other = f"SELECT {column} FROM fpmatch_entry WHERE id = 5"
    value = "'x'" if column in {"finger", "impression"} else "x'07'" if column == "content" else ""
    value = value or (f"{column} + 1" if column in {"dpi", "minutiae"} else f"({other})")
    changed(path, f"UPDATE fpmatch_entry SET {column} = {value} WHERE id = 3")
    assert candidates(path) == expected
    with open_gallery(path) as gallery:
        assert len(list(gallery.templates())) == len(PRINTS) - 1
        assert list(gallery.damaged) == [3]


@kinds
def test_subjects_that_were_exchanged_are_damage_of_both(tmp_path, encrypt):
    path = filled(tmp_path / "g.db", encrypt=encrypt)
    expected = [one for one in candidates(path) if one[0] not in {str(LABELS[0]), str(LABELS[4])}]
    for number, subject in ((1, "-"), (5, LABELS[0].subject), (1, LABELS[4].subject)):
        changed(path, "UPDATE fpmatch_entry SET subject = ? WHERE id = ?", subject, number)
    assert candidates(path) == expected


def test_what_is_left_can_be_enrolled_in_a_new_gallery(tmp_path):
    path = filled(tmp_path / "g.db")
    changed(path, "UPDATE fpmatch_entry SET subject = 'x' WHERE id = 4")
    with open_gallery(path) as source, open_gallery(tmp_path / "new.db", create=True) as gallery:
        done = enrol_gallery(gallery, source)
        assert (done.enrolled, len(done.failures)) == (5, 1)
        assert [one.source for one in done.failures] == [f"{path}: entry 4"]


@pytest.mark.parametrize("version", [1, 2, 5])
def test_a_gallery_of_another_version_is_refused(tmp_path, version):
    path = filled(tmp_path / "g.db")
    changed(path, "UPDATE fpmatch_gallery SET version = ?", version)
    with pytest.raises(Exception, match=f"of version {version}; this fpmatch reads") as caught:
        open_gallery(path)
    assert caught.value.code == "version"
