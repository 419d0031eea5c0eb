"""Prints are prepared once: kept beside the gallery, renewed where it has changed."""

import os
from types import SimpleNamespace

import numpy as np
import platformdirs
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_prints import DAMAGES, entry_of, flipped, scattered

from fpmatch.errors import FpmatchError, OutputError
from fpmatch.gallery.engine.engine import processes, serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index import prepared as prepared_module
from fpmatch.gallery.index.prepared import COLUMNS, load_prepared, prepare_gallery, save_prepared
from fpmatch.gallery.index.prints.compare import similarities
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.store.array_file import (
    decode_arrays,
    encode_arrays,
    read_content,
    write_content,
)
from fpmatch.matching.matchers.unit_circle import MATCHER, UnitCircleMatcher


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


def test_prints_prepared_with_other_parameters_are_neither_kept_nor_taken(filled, cache):
    open_search(filled, engine=serial())
    kept = files_kept(filled, cache)
    matcher = UnitCircleMatcher(neighbours=4, reach_px=14)
    search = open_search(filled, matcher, engine=serial())
    assert isinstance(search.prints, list)
    assert files_kept(filled, cache) == kept
    probe = matcher.prepare(new_entry(3).template)
    assert search.similarities(probe, np.arange(len(search))).tolist() == [
        matcher.compare(probe, matcher.prepare(template)).similarity
        for _, template in filled.templates()
    ]


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


def test_what_is_removed_is_gone_and_order_is_kept(filled):
    prepare(filled)
    numbers = [entry.id for entry in filled.entries()]
    filled.remove([numbers[1], numbers[4]])
    filled.add([new_entry(20), new_entry(1)])
    renewed, count = prepare(filled)
    assert count == 2  # of number 1, too, nothing was left when it was removed
    assert renewed.numbers.tolist() == [entry.id for entry in filled.entries()]
    assert same(renewed, afresh(filled))


def test_another_gallery_of_the_same_name_is_not_mixed_up(tmp_path):
    for seed in (0, 50):
        (tmp_path / "g.db").unlink(missing_ok=True)
        with open_gallery(tmp_path / "g.db", create=True) as gallery:
            gallery.add([new_entry(number, shown=seed + number) for number in range(3)])
            assert same(prepare(gallery)[0], afresh(gallery))


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


def test_a_damaged_file_of_the_gallery_as_it_was_is_not_copied_from(gallery):
    gallery.add([new_entry(number) for number in range(3)])
    prepare(gallery)
    path = file_of(gallery)
    path.write_bytes(flipped(path.read_bytes(), 2000))
    gallery.add([new_entry(9)])
    found, count, notes = prepare_noting(gallery)
    assert (count, len(notes)) == (4, 1)
    assert same(found, afresh(gallery))
    assert file_of(gallery) != path


@pytest.mark.parametrize("change", ["gallery", "matcher", "version", "how"])
def test_a_file_of_another_gallery_matcher_or_version_is_renewed(
    gallery, tmp_path, monkeypatch, change
):
    gallery.add([new_entry(number) for number in range(3)])
    first, _ = prepare(gallery)
    path = file_of(gallery)
    if change == "gallery":
        with open_gallery(tmp_path / "other.db", create=True) as other:
            other.add([new_entry(number) for number in range(50, 53)])
            prepare(other)
            file_of(other).replace(path)
    else:
        matcher = SimpleNamespace(name="another") if change == "matcher" else MATCHER
        with monkeypatch.context() as patch:
            if change == "version":
                patch.setattr(prepared_module, "__version__", "0.0.1")
            if change == "how":
                patch.setattr(prepared_module.prepared_prints, "preparation", lambda: "otherwise")
            save_prepared(path, first, matcher)
    again, count, notes = prepare_noting(gallery)
    words = "are of another version or gallery"
    assert notes == [f"prepared prints of {gallery.name} {words}: prepared again"]
    assert (count, same(again, first)) == (3, True)
    assert prepare(gallery)[1] == 0


def test_files_of_the_versions_before_are_removed_without_a_word(gallery):
    gallery.add([new_entry(number) for number in range(3)])
    prepare(gallery)
    path = file_of(gallery)
    for name in (f"{path.stem}.prints", f"{path.stem}.entries.npy", f"{MATCHER.name}-0.1-a.prints"):
        path.with_name(name).write_bytes(b"fpmatch prepared prints 4\n")
    path.unlink()
    assert prepare(gallery)[1] == 3
    assert file_of(gallery) == path


def test_what_a_killed_process_left_is_removed(gallery):
    gallery.add([new_entry(number) for number in range(3)])
    prepare(gallery)
    path = file_of(gallery)
    left, recent = (path.with_name(f".{digit * 16}.part") for digit in "01")
    for unfinished in (left, recent):
        unfinished.write_bytes(path.read_bytes()[:99])
    os.utime(left, (0, 0))
    gallery.add([new_entry(9)])
    prepare(gallery)
    assert not left.exists()
    assert recent.exists()


OTHER_THAN_FILES = ["folder"]
if os.name == "posix":
    OTHER_THAN_FILES += ["pipe", "link to nothing", "link to itself"]


@pytest.mark.parametrize("in_the_way", OTHER_THAN_FILES)
def test_what_is_no_file_is_left_and_the_search_goes_on(gallery, cache, in_the_way):
    gallery.add([new_entry(number) for number in range(3)])
    first, _ = prepare(gallery)
    path = file_of(gallery)
    path.unlink()
    match in_the_way:
        case "folder":
            path.mkdir()
            (path / "something").touch()
        case "pipe":
            os.mkfifo(path)
        case "link to nothing":
            path.symlink_to("nothing")
        case "link to itself":
            path.symlink_to(path)
    again, count, notes = prepare_noting(gallery)
    assert (count, same(again, first)) == (3, True)
    expected = [f"prepared prints of {gallery.name} cannot be read: prepared again"]
    assert notes == ([] if "link" in in_the_way else expected)
    assert prepare(gallery)[1] == 0
    assert len(list((cache / "fpmatch").glob("*/*/*"))) == (in_the_way == "folder")


def test_where_a_damaged_file_cannot_be_replaced_the_search_goes_on(gallery, monkeypatch):
    def full(path, *_, **__):
        raise OutputError("cannot be written: no space left on device", path=path)

    gallery.add([new_entry(number) for number in range(3)])
    first, _ = prepare(gallery)
    path = file_of(gallery)
    path.write_bytes(path.read_bytes()[:-1])
    monkeypatch.setattr(prepared_module, "write_arrays", full)
    for _ in range(2):
        again, count, notes = prepare_noting(gallery)
        assert (count, len(notes), same(again, first)) == (3, 1, True)


def candidates(search):
    """Return what a search finds, to the last bit."""
    return repr(identify(search, new_entry(2).template, transforms=True).candidates)


@pytest.fixture(scope="module")
def kept_file(tmp_path_factory):
    """Return a small gallery, its file, the content of that, and the candidates of a search."""
    folder = tmp_path_factory.mktemp("kept")
    with (
        pytest.MonkeyPatch.context() as patch,
        open_gallery(folder / "g.db", create=True) as opened,
    ):
        patch.setattr(platformdirs, "user_cache_path", lambda name: folder / "cache" / name)
        opened.add([new_entry(number) for number in range(4)])
        found = candidates(open_search(opened, engine=serial()))
        assert "number=3" in found
        path = file_of(opened)
        yield SimpleNamespace(gallery=opened, path=path, whole=path.read_bytes(), found=found)


def check_renewed(kept, content):
    """Hold a search with another file to the candidates of the whole one, and to one note."""
    kept.path.write_bytes(content)
    notes = []
    search = open_search(kept.gallery, engine=serial(), note=notes.append)
    assert candidates(search) == kept.found
    assert len(notes) == 1
    assert kept.path.read_bytes() == kept.whole


def test_a_flip_at_any_of_many_places_changes_no_candidate(kept_file):
    for place in range(0, len(kept_file.whole), max(1, len(kept_file.whole) // 60)):
        check_renewed(kept_file, flipped(kept_file.whole, place))


@given(data=st.data())
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_numbers_with_right_checksums_lead_nowhere_else(kept_file, data):
    """A file that someone made: its arrays are used only as far as none of them leads astray.

    What they state may be another print, but nothing is read beside the arrays.
    """
    header, content = read_content(kept_file.path)
    about = prepared_module._about(kept_file.path, MATCHER)
    arrays = {k: a.copy() for k, a in decode_arrays(header, content, COLUMNS, about).items()}
    name = data.draw(st.sampled_from(sorted(arrays)))
    flat = arrays[name].reshape(-1).view(np.uint8)
    for _ in range(data.draw(st.integers(1, 4))):
        flat[data.draw(st.integers(0, len(flat) - 1))] = data.draw(st.integers(0, 255))
    path = kept_file.path.with_name("made") / kept_file.path.name
    path.parent.mkdir(exist_ok=True)
    with path.open("wb") as stream:
        write_content(stream, *encode_arrays(arrays, COLUMNS, about))
    try:
        prints = load_prepared(path, MATCHER).prints
    except FpmatchError:
        return
    probe = MATCHER.prepare(new_entry(2).template)
    with np.errstate(all="ignore"):
        found = similarities(MATCHER, probe, prints)
    assert found.shape == (4,)


def test_without_a_function_for_notes_there_is_a_warning(kept_file):
    kept_file.path.write_bytes(b"")
    with pytest.warns(RuntimeWarning, match="damaged: prepared again"):
        assert candidates(open_search(kept_file.gallery, engine=serial())) == kept_file.found


def test_where_nothing_can_be_kept_beside_it_the_cache_does(gallery, tmp_path, cache):
    (tmp_path / "gallery.db.prepared").write_text("in the way")
    gallery.add([new_entry(number) for number in range(3)])
    assert [prepare(gallery)[1] for _ in range(2)] == [3, 0]
    (folder,) = (cache / "fpmatch" / "galleries").iterdir()
    assert len(list(folder.iterdir())) == 1


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
    assert len(open_search(gallery)) == 0
