"""Prints are prepared once: kept beside the gallery, renewed where it has changed."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import platformdirs
import pytest

from fpmatch.engine.engine import processes, serial
from fpmatch.errors import GalleryError
from fpmatch.gallery import prepared as prepared_module
from fpmatch.gallery.entry import Label, NewEntry
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.prepared import prepare_gallery
from fpmatch.gallery.search import open_search
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.minutiae import Minutiae, Template


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """Give the user another cache folder, and return it."""
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda name: tmp_path / "cache" / name)
    return tmp_path / "cache"


def new_entry(number: int, finger: int | None = None) -> NewEntry:
    """Return a print of 12 minutiae, all of whose contents follow its number, or its finger's."""
    rng = np.random.default_rng(number if finger is None else finger)
    n = 12
    minutiae = Minutiae(
        x=rng.uniform(20, 280, n), y=rng.uniform(20, 280, n), angle=rng.uniform(0, 6, n)
    )
    template = Template(minutiae, 300, 300, (500.0, 569.0)[number % 2])
    return NewEntry(Label(str(number)), f"{number}.tif", number.to_bytes(32, "big"), template)


@pytest.fixture
def gallery(where):
    with open_gallery(where, create=True) as gallery:
        gallery.add([new_entry(number) for number in range(6)])
        yield gallery


def prepare(gallery, told=None):
    """Return the prepared prints; `told` receives how many were prepared for it."""
    progress = (lambda *row: None) if told is None else lambda _, done, total: told.append(done)
    return prepare_gallery(gallery, MATCHER, engine=serial(), progress=progress)


def same(one, other):
    return np.array_equal(one.entries, other.entries) and all(
        np.array_equal(getattr(one.prints, f.name), getattr(other.prints, f.name))
        for f in fields(one.prints)
    )


def afresh(gallery, monkeypatch):
    """Return the prints prepared without those that are kept."""
    with monkeypatch.context() as patch:
        patch.setattr(prepared_module, "_folders", lambda _: [])
        return prepare(gallery)


def kept_in(gallery, cache):
    """Return the folder where prints are to be kept."""
    file = gallery.database.file
    if file is not None:
        return file.with_name(f"{file.name}.prepared")
    (folder,) = (cache / "fpmatch" / "galleries").iterdir()
    return folder


def test_the_search_finds_what_comparing_one_by_one_finds(gallery):
    search = open_search(gallery, engine=serial())
    probe = MATCHER.prepare(new_entry(3).template)
    expected = [
        MATCHER.compare(probe, MATCHER.prepare(template)).similarity
        for _, template in gallery.templates()
    ]
    assert search.similarities(probe).tolist() == expected
    assert search.numbers.tolist() == [entry.id for entry in gallery.entries()]


def test_a_second_search_prepares_nothing(gallery, cache):
    told: list[int] = []
    first = prepare(gallery, told)
    assert told[-1] == 6
    folder = kept_in(gallery, cache)
    assert len(list(folder.iterdir())) == 2
    again: list[int] = []
    assert same(prepare(gallery, again), first)
    assert again == []


def test_only_what_is_new_is_prepared(gallery, cache, monkeypatch):
    prepare(gallery)
    gallery.add([new_entry(number) for number in range(6, 9)])
    told: list[int] = []
    renewed = prepare(gallery, told)
    assert told[-1] == 3
    assert same(renewed, afresh(gallery, monkeypatch))
    assert len(list(kept_in(gallery, cache).iterdir())) == 2


def test_what_is_removed_is_gone_and_order_is_kept(gallery, monkeypatch):
    prepare(gallery)
    numbers = [entry.id for entry in gallery.entries()]
    gallery.remove([numbers[1], numbers[4]])
    gallery.add([new_entry(20), new_entry(1)])
    told: list[int] = []
    renewed = prepare(gallery, told)
    assert told[-1] == 1  # number 1 was prepared before it was removed
    assert renewed.entries["number"].tolist() == [entry.id for entry in gallery.entries()]
    assert same(renewed, afresh(gallery, monkeypatch))


def test_another_gallery_of_the_same_name_is_not_mixed_up(tmp_path, monkeypatch):
    for seed in (0, 50):
        (tmp_path / "g.db").unlink(missing_ok=True)
        with open_gallery(tmp_path / "g.db", create=True) as gallery:
            gallery.add([new_entry(number, finger=seed + number) for number in range(3)])
            found = prepare(gallery)
            assert same(found, afresh(gallery, monkeypatch))


@pytest.mark.parametrize("suffix", [".prints", ".entries.npy"])
@pytest.mark.parametrize("content", [b"", b"something else", None])
def test_damaged_files_are_made_anew(tmp_path, suffix, content):
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        gallery.add([new_entry(number) for number in range(4)])
        first = prepare(gallery)
        (path,) = Path(tmp_path, "g.db.prepared").glob(f"*{suffix}")
        path.write_bytes(path.read_bytes()[:-8] if content is None else content)
        told: list[int] = []
        assert same(prepare(gallery, told), first)
        assert told[-1] == 4
        assert same(prepare(gallery), first)


def test_where_nothing_can_be_kept_beside_it_the_cache_does(tmp_path, cache):
    (tmp_path / "g.db.prepared").write_text("in the way")
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        gallery.add([new_entry(number) for number in range(3)])
        prepare(gallery)
        (folder,) = (cache / "fpmatch" / "galleries").iterdir()
        assert len(list(folder.iterdir())) == 2
        again: list[int] = []
        prepare(gallery, again)
        assert again == []


def test_where_nothing_can_be_kept_at_all_the_search_goes_on(tmp_path, cache):
    (tmp_path / "g.db.prepared").write_text("in the way")
    cache.write_text("in the way")
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        gallery.add([new_entry(number) for number in range(3)])
        assert len(prepare(gallery).prints) == 3


def test_what_is_enrolled_meanwhile_does_not_pass_for_the_content_before(tmp_path, monkeypatch):
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        gallery.add([new_entry(number) for number in range(3)])
        renew = prepared_module._renew

        def slowly(*arguments):
            gallery.add([new_entry(9)])
            return renew(*arguments)

        with monkeypatch.context() as patch:
            patch.setattr(prepared_module, "_renew", slowly)
            prepare(gallery)
        gallery.remove([list(gallery.entries())[-1].id])
        assert len(prepare(gallery).prints) == 3


def test_any_number_of_workers_prepares_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(prepared_module, "PRINTS_PER_CHUNK", 2)
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        gallery.add([new_entry(number) for number in range(5)])
        one = afresh(gallery, monkeypatch)
        two = prepare_gallery(gallery, MATCHER, engine=processes(2), progress=lambda *_: None)
        assert same(one, two)


def test_an_empty_gallery_is_prepared_too(tmp_path):
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        assert len(prepare(gallery).prints) == 0
        assert len(prepare(gallery).prints) == 0
        assert open_search(gallery).similarities(MATCHER.prepare(new_entry(1).template)).size == 0


def test_a_damaged_template_is_named(tmp_path, monkeypatch):
    with open_gallery(tmp_path / "g.db", create=True) as gallery:
        monkeypatch.setattr(gallery, "packed_templates", lambda **_: [(7, b"fm" + bytes(60))])
        with pytest.raises(GalleryError, match=r"g\.db: damaged: entry 7: "):
            prepare(gallery)
