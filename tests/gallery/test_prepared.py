"""Prints are prepared once: kept beside the gallery, renewed where it has changed."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import platformdirs
import pytest
from made_prints import entry_of, scattered

from fpmatch.engine.engine import processes, serial
from fpmatch.errors import GalleryError
from fpmatch.gallery import prepared as prepared_module
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.prepared import prepare_gallery
from fpmatch.gallery.search import open_search
from fpmatch.matching.matchers.unit_circle import MATCHER


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """Give the user another cache folder, and return it."""
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda name: tmp_path / "cache" / name)
    return tmp_path / "cache"


def new_entry(number, shown=None):
    """Return a print whose contents follow its number; its template, that of what it shows."""
    dpi = (500.0, 569.0)[number % 2]
    return entry_of(number, scattered(number if shown is None else shown, 12, dpi))


@pytest.fixture
def filled(where):
    """Return an open gallery of six prints, on either kind of database."""
    with open_gallery(where, create=True) as opened:
        opened.add([new_entry(number) for number in range(6)])
        yield opened


def prepare(gallery, engine=None):
    """Return the prepared prints, and how many were prepared for it."""
    told = [0]
    made = prepare_gallery(
        gallery,
        MATCHER,
        engine=engine or serial(),
        progress=lambda _, done, total: told.append(done),
    )
    return made, told[-1]


def same(one, other):
    return np.array_equal(one.entries, other.entries) and all(
        np.array_equal(getattr(one.prints, f.name), getattr(other.prints, f.name))
        for f in fields(one.prints)
    )


def afresh(gallery):
    """Return the prints prepared without those that are kept."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prepared_module, "_folders", lambda _: [])
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
    assert search.similarities(probe).tolist() == expected
    assert search.numbers.tolist() == [entry.id for entry in filled.entries()]


def test_only_what_is_new_is_prepared(filled, cache):
    first, count = prepare(filled)
    assert (count, files_kept(filled, cache)) == (6, 2)
    again, count = prepare(filled)
    assert count == 0
    assert same(again, first)
    filled.add([new_entry(number) for number in range(6, 9)])
    renewed, count = prepare(filled)
    assert count == 3
    assert same(renewed, afresh(filled))
    assert files_kept(filled, cache) == 2


def test_what_is_removed_is_gone_and_order_is_kept(filled):
    prepare(filled)
    numbers = [entry.id for entry in filled.entries()]
    filled.remove([numbers[1], numbers[4]])
    filled.add([new_entry(20), new_entry(1)])
    renewed, count = prepare(filled)
    assert count == 1  # number 1 was prepared before it was removed
    assert renewed.entries["number"].tolist() == [entry.id for entry in filled.entries()]
    assert same(renewed, afresh(filled))


def test_another_gallery_of_the_same_name_is_not_mixed_up(tmp_path):
    for seed in (0, 50):
        (tmp_path / "g.db").unlink(missing_ok=True)
        with open_gallery(tmp_path / "g.db", create=True) as gallery:
            gallery.add([new_entry(number, shown=seed + number) for number in range(3)])
            assert same(prepare(gallery)[0], afresh(gallery))


@pytest.mark.parametrize("suffix", [".prints", ".entries.npy"])
@pytest.mark.parametrize("content", [b"", b"something else", None])
def test_damaged_files_are_made_anew(gallery, tmp_path, suffix, content):
    gallery.add([new_entry(number) for number in range(4)])
    first, _ = prepare(gallery)
    (path,) = (tmp_path / "gallery.db.prepared").glob(f"*{suffix}")
    path.write_bytes(path.read_bytes()[:-8] if content is None else content)
    for expected in (4, 0):
        again, count = prepare(gallery)
        assert count == expected
        assert same(again, first)


def test_where_nothing_can_be_kept_beside_it_the_cache_does(gallery, tmp_path, cache):
    (tmp_path / "gallery.db.prepared").write_text("in the way")
    gallery.add([new_entry(number) for number in range(3)])
    assert [prepare(gallery)[1] for _ in range(2)] == [3, 0]
    (folder,) = (cache / "fpmatch" / "galleries").iterdir()
    assert len(list(folder.iterdir())) == 2


def test_where_nothing_can_be_kept_at_all_the_search_goes_on(gallery, tmp_path, cache):
    (tmp_path / "gallery.db.prepared").write_text("in the way")
    cache.write_text("in the way")
    gallery.add([new_entry(number) for number in range(3)])
    assert len(prepare(gallery)[0].prints) == 3


def test_what_is_enrolled_meanwhile_does_not_pass_for_the_content_before(gallery, monkeypatch):
    gallery.add([new_entry(number) for number in range(3)])
    renew = prepared_module._renew

    def slowly(*arguments):
        gallery.add([new_entry(9)])
        return renew(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(prepared_module, "_renew", slowly)
        prepare(gallery)
    gallery.remove([list(gallery.entries())[-1].id])
    assert len(prepare(gallery)[0].prints) == 3


def test_any_number_of_workers_prepares_the_same(gallery, monkeypatch):
    monkeypatch.setattr(prepared_module, "PRINTS_PER_CHUNK", 2)
    gallery.add([new_entry(number) for number in range(5)])
    assert same(afresh(gallery), prepare(gallery, processes(2))[0])


def test_an_empty_gallery_is_prepared_too(gallery):
    assert [len(prepare(gallery)[0].prints) for _ in range(2)] == [0, 0]
    assert open_search(gallery).similarities(MATCHER.prepare(new_entry(1).template)).size == 0


def test_a_damaged_template_is_named(gallery, monkeypatch):
    monkeypatch.setattr(gallery, "packed_templates", lambda **_: [(7, b"fm" + bytes(60))])
    with pytest.raises(GalleryError, match=r"gallery\.db: damaged: entry 7: ") as caught:
        prepare(gallery)
    assert caught.value.code == "damaged"
