"""A large gallery is searched by its index, in stages, as it is at the moment of each search."""

import pytest
from made_prints import entry_of, scattered

from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.fingers.finger import fused_score
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search import search as search_module
from fpmatch.gallery.search import shortlist as module
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.search import Search
from fpmatch.matching.verify import verify

SIZE = 40


@pytest.fixture(autouse=True)
def small_limits(monkeypatch):
    """Index galleries of more than ten prints; compare few of them."""
    monkeypatch.setattr(search_module, "EXHAUSTIVE_UP_TO", 10)
    monkeypatch.setattr(module, "LEAST_BY_TERMS", 20)
    monkeypatch.setattr(module, "LEAST_BY_DESCRIPTORS", 6)


def print_of(number):
    return scattered(number, 30)


def new_entry(number, finger=None):
    label = Label(str(number if finger is None else finger), impression=str(number))
    return entry_of(number, print_of(number), label)


@pytest.fixture
def filled(where):
    with open_gallery(where, create=True) as opened:
        opened.add([new_entry(number) for number in range(SIZE)])
        yield opened


@pytest.fixture
def large(gallery):
    gallery.add([new_entry(number) for number in range(SIZE)])
    return gallery


def opened(gallery, **options):
    return Search(gallery, engine=serial(), note=pytest.fail, **options)


def best(search, number):
    """Return number and score of the best candidate for an enrolled print."""
    result = identify(search, print_of(number), count=1)
    return result.candidates[0].number, round(result.candidates[0].score)


def test_each_print_is_found_among_few_that_are_compared(filled):
    search = opened(filled)
    assert len(search) == SIZE
    for number in range(0, SIZE, 7):
        result = identify(search, print_of(number), count=3, transforms=True)
        assert result.candidates[0].number == number + 1
        assert result.candidates[0].comparison.transform is not None
        assert (result.enrolled, result.fingers) == (SIZE, SIZE)
        assert result.passed_on == (20, 6)
        assert result.compared == 6
        assert result.effort == 1
        assert result.preselected
        assert identify(search, print_of(number), count=3, effort=2).passed_on == (40, 12)


def test_a_small_gallery_is_compared_whole(large):
    large.remove(range(11, SIZE + 1))
    search = opened(large)
    assert not search.preselected
    result = identify(search, print_of(3), effort=4)
    assert (result.effort, result.passed_on, result.compared) == (None, (), 10)


def test_a_search_changes_with_the_size_of_its_gallery(large):
    search = opened(large)
    large.remove(range(11, SIZE + 1))
    assert identify(search, print_of(3)).effort is None
    large.add([new_entry(number) for number in range(50, 60)])
    result = identify(search, print_of(55))
    assert (result.effort, result.entries[0].source) == (1, new_entry(55).source)


def test_all_impressions_of_a_finger_that_ranks_first_are_compared(gallery):
    """Those that are not similar to the probe, too."""
    gallery.add([new_entry(k, k // 4) for k in range(SIZE)])
    result = identify(opened(gallery), print_of(9), count=1)
    (candidate,) = result.candidates
    assert (candidate.number, candidate.impressions, result.fingers) == (10, 4, 10)
    alone = [verify(print_of(9), gallery.template(k)).score for k in (9, 10, 11, 12)]
    assert candidate.score == pytest.approx(fused_score(alone))


def test_candidates_do_not_depend_on_the_segments(large, monkeypatch):
    expected = [repr(identify(opened(large), print_of(k)).candidates) for k in range(5)]
    for most in (1, 7, 16):
        for path in large.file.with_name(f"{large.file.name}.prepared").iterdir():
            path.unlink()
        with monkeypatch.context() as patch:
            patch.setattr("fpmatch.gallery.index.follow.MOST_PRINTS", most)
            search = opened(large)
        assert len(search._index.segments) == -(-SIZE // most)
        assert [repr(identify(search, print_of(k)).candidates) for k in range(5)] == expected


def test_an_open_search_follows_the_gallery_and_so_does_that_of_another_server(filled):
    one, other = opened(filled), opened(filled)
    assert best(one, 5) == best(other, 5)
    filled.add([new_entry(100)])
    assert best(one, 100)[0] == best(other, 100)[0] == SIZE + 1
    filled.remove([SIZE + 1, 6])
    for search in (one, other):
        assert best(search, 100)[0] != SIZE + 1
        assert best(search, 5)[0] != 6
        assert identify(search, print_of(5)).enrolled == SIZE - 1


@pytest.mark.usefixtures("source")
def test_the_index_of_an_encrypted_gallery_is_encrypted(tmp_path):
    with open_gallery(tmp_path / "g.db", create=True, encrypt=True) as gallery:
        gallery.add([new_entry(number) for number in range(SIZE)])
        expected = best(opened(gallery), 5)
        paths = list((tmp_path / "g.db.prepared").iterdir())
        assert {path.suffix for path in paths} == {".segment"}
        arrays = opened(gallery)._index.segments[0].arrays()
        content = b"".join(path.read_bytes() for path in paths)
        for name, array in arrays.items():
            if array.nbytes > 64:
                assert array.tobytes()[:64] not in content, name
        gallery.remove([1])
        assert best(opened(gallery), 5) == expected
