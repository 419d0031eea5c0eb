"""A large gallery is searched by its index, in stages, as it is at the moment of each search."""

from math import inf

import pytest
from made_prints import entry_of, scattered

from fpmatch.errors import MatcherError
from fpmatch.formats.files import save_template
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index.loss import DEFAULT_LOSS, SearchPlan
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search import indexed as module
from fpmatch.gallery.search import opening
from fpmatch.gallery.search.entries import identify_entries
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.indexed import IndexedSearch
from fpmatch.gallery.search.opening import open_search

SIZE = 40


@pytest.fixture(autouse=True)
def small_limits(monkeypatch):
    """Index galleries of more than ten prints; compare few of them."""
    monkeypatch.setattr(opening, "EXHAUSTIVE_UP_TO", 10)
    monkeypatch.setattr(
        module, "search_rounds", lambda loss, *_, **__: [(SearchPlan(loss, 0.5, 20, 6), inf)]
    )


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
    return open_search(gallery, engine=serial(), note=pytest.fail, **options)


def best(gallery, search, number):
    """Return number and score of the best candidate for an enrolled print."""
    result, _ = identify_entries(gallery, search, print_of(number), count=1)
    return result.candidates[0].number, round(result.candidates[0].score)


def test_each_print_is_found_among_few_that_are_compared(filled):
    search = opened(filled)
    assert isinstance(search, IndexedSearch)
    assert len(search) == SIZE
    for number in range(0, SIZE, 7):
        result = identify(search, print_of(number), count=3, transforms=True)
        assert result.candidates[0].number == number + 1
        assert result.candidates[0].comparison.transform is not None
        assert (result.enrolled, result.fingers) == (SIZE, SIZE)
        assert result.passed_on == (20, 6, 6)
        assert result.compared == 6
        assert result.loss == DEFAULT_LOSS
        assert result.preselected


def test_a_loss_of_0_compares_all_prints_and_so_does_a_search_of_a_small_gallery(large):
    search, whole = opened(large), opened(large, loss=0)
    assert not isinstance(whole, IndexedSearch)
    probe = print_of(3)
    one, other = (identify(s, probe, loss=0) for s in (search, whole))
    assert one == other == identify(whole, probe)
    assert (one.loss, one.passed_on, one.compared) == (None, (), SIZE)
    large.remove(range(11, SIZE + 1))
    assert not isinstance(opened(large), IndexedSearch)


def test_candidates_do_not_depend_on_the_segments(large, monkeypatch):
    expected = [repr(identify(opened(large), print_of(k)).candidates) for k in range(5)]
    for most in (1, 7, 16):
        for path in large.file.with_name(f"{large.file.name}.prepared").iterdir():
            path.unlink()
        with monkeypatch.context() as patch:
            patch.setattr("fpmatch.gallery.index.gallery_index.MOST_PRINTS", most)
            patch.setattr("fpmatch.gallery.index.state.MOST_OF_A_SIZE", 1000)
            search = opened(large)
        assert len(search.state.parts) == -(-SIZE // most)
        assert [repr(identify(search, print_of(k)).candidates) for k in range(5)] == expected


def test_an_open_search_follows_the_gallery_and_so_does_that_of_another_server(filled):
    one, other = opened(filled), opened(filled)
    assert best(filled, one, 5) == best(filled, other, 5)
    filled.add([new_entry(100)])
    assert best(filled, one, 100)[0] == best(filled, other, 100)[0] == SIZE + 1
    filled.remove([SIZE + 1, 6])
    for search in (one, other):
        assert best(filled, search, 100)[0] != SIZE + 1
        assert best(filled, search, 5)[0] != 6
        assert identify_entries(filled, search, print_of(5))[0].enrolled == SIZE - 1


def test_a_removed_entry_is_no_candidate_of_a_search_that_does_not_follow(large):
    search = opened(large, loss=0)
    assert best(large, search, 5)[0] == 6
    large.remove([6])
    result, entries = identify_entries(large, search, print_of(5))
    assert 6 not in [entry.id for entry in entries]
    assert result.enrolled == SIZE - 1


def test_skipped_entries_are_as_if_they_were_not_enrolled(gallery):
    gallery.add([new_entry(k, k // 2) for k in range(SIZE)])
    result = identify(opened(gallery), print_of(4), skipped={5, 999, 7, 8})
    assert result.candidates[0].number != 5
    assert (result.enrolled, result.fingers) == (SIZE - 3, SIZE // 2 - 1)


@pytest.mark.parametrize("loss", [-1.0, 1.0, float("nan")])
def test_an_impossible_loss_is_refused(large, loss):
    with pytest.raises(MatcherError, match="loss"):
        identify(opened(large), print_of(3), loss=loss)


@pytest.fixture
def probe(tmp_path):
    save_template(tmp_path / "probe.json", print_of(3))
    return str(tmp_path / "probe.json")


@pytest.mark.usefixtures("source")
def test_the_index_of_an_encrypted_gallery_is_encrypted(tmp_path):
    with open_gallery(tmp_path / "g.db", create=True, encrypt=True) as gallery:
        gallery.add([new_entry(number) for number in range(SIZE)])
        expected = best(gallery, opened(gallery), 5)
        paths = list((tmp_path / "g.db.prepared").iterdir())
        assert {path.suffix for path in paths} == {".segment", ".index"}
        templates = [open_search(gallery, engine=serial()).state.segments[0].arrays()]
        content = b"".join(path.read_bytes() for path in paths)
        for name, array in templates[0].items():
            if array.nbytes > 64:
                assert array.tobytes()[:64] not in content, name
        gallery.remove([1])
        assert best(gallery, opened(gallery), 5) == expected


def test_prints_are_added_to_a_search_and_not_to_the_gallery(large):
    search, before = opened(large), large.content_hash()
    number = best(large, search, 3)[0]
    last = max(entry.id for entry in large.entries())
    with_more = search.with_prints([print_of(70), print_of(71)])
    assert isinstance(with_more, IndexedSearch)
    assert len(with_more) == SIZE + 2
    assert (
        with_more.numbers[-2:].tolist() == with_more.fingers[-2:].tolist() == [last + 1, last + 2]
    )
    found = [identify(with_more, print_of(k), count=1).candidates[0].number for k in (3, 70, 71)]
    assert found == [number, last + 1, last + 2]
    assert identify(with_more, print_of(71), skipped={last + 2}).candidates[0].number != last + 2
    whole = identify(with_more, print_of(71), count=1, loss=0)
    assert (whole.compared, whole.candidates[0].number) == (SIZE + 2, last + 2)
    assert (len(search), large.content_hash()) == (SIZE, before)
