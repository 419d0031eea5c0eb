"""Prints are prepared once: kept beside the gallery, renewed where it has changed."""

import numpy as np
import pytest
from made_prints import DAMAGES, entry_of, scattered

from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index import prepared as prepared_module
from fpmatch.gallery.index.prepared import prepare_gallery
from fpmatch.gallery.search.opening import open_search
from fpmatch.matching.matchers.unit_circle import MATCHER


def new_entry(number, shown=None):
    """Return a print whose contents follow its number; its template, that of what it shows."""
    dpi = (500.0, 569.0)[number % 2]
    return entry_of(number, scattered(number if shown is None else shown, 12, dpi))


@pytest.fixture
def filled(where):
    with open_gallery(where, create=True) as opened:
        opened.add([new_entry(number) for number in range(6)])
        yield opened


def prepare(gallery, engine=None):
    """Return the prepared prints, and how many were prepared for it; there must be no notes."""
    made, count, notes = prepare_noting(gallery, engine)
    assert notes == []
    return made, count


def prepare_noting(gallery, engine=None):
    """Return the prepared prints, how many were prepared for it, and the notes."""
    counts, notes = [0], []
    made = prepare_gallery(
        gallery,
        MATCHER,
        engine=engine or serial(),
        progress=lambda _, done, total: counts.append(done),
        note=notes.append,
    )
    return made, counts[-1], notes


def arrays_of(prepared):
    numbers, digests = prepared.numbers.tolist(), prepared.digest_list()
    arrays = {k: (a.dtype, a.tolist()) for k, a in prepared.prints.arrays().items()}
    return numbers, prepared.fingers.tolist(), digests, arrays


def same(one, other):
    return arrays_of(one) == arrays_of(other)


def afresh(gallery):
    """Return the prints prepared without those that are kept."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prepared_module, "kept_folders", lambda _: [])
        return prepare(gallery)[0]


def files_kept(gallery, cache):
    """Return how many files are in the folder where prints are to be kept."""
    file = gallery.file
    if file is not None:
        return len(list(file.with_name(f"{file.name}.prepared").iterdir()))
    (folder,) = (cache / "fpmatch" / "galleries").iterdir()
    return len(list(folder.iterdir()))


def test_the_search_finds_what_comparing_one_by_one_finds(filled):
    search = open_search(filled, engine=serial())
    probe = MATCHER.prepare(new_entry(3).template)
    expected = [
        MATCHER.compare(probe, MATCHER.prepare(template)).similarity
        for _, template in filled.templates()
    ]
    assert search.similarities(probe, np.arange(len(search))).tolist() == expected
    assert search.numbers.tolist() == [entry.id for entry in filled.entries()]


def test_only_what_is_new_is_prepared(filled, cache):
    first, count = prepare(filled)
    assert (count, files_kept(filled, cache)) == (6, 1)
    again, count = prepare(filled)
    assert count == 0
    assert same(again, first)
    filled.add([new_entry(number) for number in range(6, 9)])
    renewed, count = prepare(filled)
    assert count == 3
    assert same(renewed, afresh(filled))
    assert files_kept(filled, cache) == 1


def file_of(gallery):
    folder = gallery.file.with_name(f"{gallery.file.name}.prepared")
    (path,) = folder.iterdir()
    return path


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_renewed_with_a_note(gallery, damage):
    gallery.add([new_entry(number) for number in range(4)])
    first, _ = prepare(gallery)
    path = file_of(gallery)
    path.write_bytes(DAMAGES[damage](path.read_bytes()))
    again, count, notes = prepare_noting(gallery)
    assert count == 4
    assert notes == [f"prepared prints of {gallery.name} are damaged: prepared again"]
    assert same(again, first)
    assert prepare(gallery)[1] == 0
    assert same(prepare(gallery)[0], first)


def test_where_nothing_can_be_kept_at_all_the_search_goes_on(gallery, tmp_path, cache):
    (tmp_path / "gallery.db.prepared").write_text("in the way")
    cache.write_text("in the way")
    gallery.add([new_entry(number) for number in range(3)])
    assert len(prepare(gallery)[0].prints) == 3
