"""Searches by pieces of a gallery: the candidates of a search in one process, to the last bit."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_prints import FAKE, entries_of, scattered, template_at

from fpmatch.errors import MatcherError
from fpmatch.gallery import search_pieces
from fpmatch.gallery.engine.engine import processes, serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.identify import identify
from fpmatch.gallery.prepared_search import Search
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.search_pieces import batch_size, hold_search, spans
from fpmatch.matching.prints.candidate_list import candidate_list
from fpmatch.matching.prints.prepare import prepare
from fpmatch.matching.prints.prepared_prints import PreparedPrints
from fpmatch.matching.registry import get_matcher

pytestmark = pytest.mark.usefixtures("small_pieces")
PROBES = [scattered(k, 10 + k) for k in (3, 11, 100)]


@pytest.fixture
def small_pieces(monkeypatch):
    monkeypatch.setattr(search_pieces, "MIN_PIECE", 1)


@pytest.fixture(scope="module")
def search(tmp_path_factory):
    """Return a search of fifty prints, two of each finger, in a file that is mapped."""
    place = tmp_path_factory.mktemp("pieces") / "gallery.db"
    with open_gallery(place, create=True) as gallery:
        gallery.add(entries_of(*(scattered(k, 10 + k % 30) for k in range(50))))
        with serial() as engine:
            open_search(gallery, engine=engine)
            return open_search(gallery, engine=engine)


def answers(search, engine, probes, **options):
    batches = [[search.matcher.prepare(one) for one in part] for part in (probes[:2], probes[2:])]
    with engine as place, hold_search(place, search) as held:
        for batch, part in zip(
            held.answers(batches, **options), (probes[:2], probes[2:]), strict=True
        ):
            yield from zip(part, map(held.answered, batch), strict=True)


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("options", [{}, {"candidate_list": 7}, {"candidate_list": 7, "count": 50}])
def test_candidates_are_those_of_one_search(search, workers, options):
    found = 0
    for probe, answered in answers(search, processes(workers), PROBES, **options):
        for more in ({}, {"impressions": True}, {"skipped": {4, 12}}, {"transforms": True}):
            expected = identify(search, probe, **options, **more)
            made = identify(answered, probe, **options, **more)
            assert repr(made.candidates) == repr(expected.candidates)
            assert (made.enrolled, made.compared, made.fingers) == (
                expected.enrolled,
                expected.compared,
                expected.fingers,
            )
        found += 1
    assert found == len(PROBES)


@given(st.lists(st.integers(0, 3), min_size=1, max_size=40), st.integers(1, 45), st.integers(1, 50))
def test_of_prints_that_score_the_same_the_same_are_chosen(kinds, most, least_pieces):
    """Many prints are equal: ties are everywhere, within pieces and between them."""
    kept = [prepare(scattered(k, 8)) for k in range(4)]
    packed = PreparedPrints.pack([kept[k] for k in kinds])
    numbers = np.arange(len(kinds))
    whole = Search(get_matcher("unit-circle"), numbers, numbers, packed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search_pieces, "LEAST_PIECES", least_pieces)
        patch.setattr(search_pieces, "MIN_PIECE", 1)
        patch.setattr("fpmatch.matching.prints.candidate_list.LEAST_PRINTS", 20)
        with serial() as engine, hold_search(engine, whole) as held:
            ((answer,),) = held.answers([[kept[0]]], candidate_list=most, count=1)
        chosen = candidate_list(kept[0], packed, most)
    assert (answer.which is None) == (most >= len(kinds))
    if answer.which is not None:
        assert answer.which.tolist() == chosen.tolist()
    assert answer.similarities.tolist() == whole.similarities(kept[0], chosen).tolist()


def test_other_matchers_are_searched_by_pieces_too(gallery):
    gallery.add(entries_of(*map(template_at, (10, 50, 200, 52, 45))))
    search = open_search(gallery, FAKE)
    ((answer,),) = _answered(search, [[50.0]])
    assert answer.similarities.tolist() == [60.0, 100.0, 0.0, 98.0, 95.0]
    with pytest.raises(MatcherError, match="no candidate list"):
        _answered(search, [[50.0]], candidate_list=2)


def test_prints_that_cannot_be_sent_are_compared_in_this_process(gallery):
    gallery.add(entries_of(*(scattered(k, 12) for k in range(6))))
    search = open_search(gallery, "paper", engine=serial())
    for probe, answered in answers(search, processes(2), PROBES):
        assert repr(identify(answered, probe).candidates) == repr(
            identify(search, probe).candidates
        )


def test_an_empty_gallery_and_no_probes(gallery):
    search = open_search(gallery, engine=serial())
    ((answer,),) = _answered(search, [[prepare(PROBES[0])]])
    assert len(answer.similarities) == 0
    assert _answered(search, []) == []


def _answered(search, batches, **options):
    with (
        serial() as engine,
        hold_search(engine, search) as held,
        closing(held.answers(batches, **options)) as found,
    ):
        return list(found)


@pytest.mark.parametrize("prints", [0, 1, 31, 33, 20_000, 1_000_003])
def test_pieces_cover_all_prints(prints):
    covered = spans(prints)
    assert [one for one, _ in covered[1:]] == [last for _, last in covered[:-1]]
    assert not covered or (covered[0][0], covered[-1][1]) == (0, prints)
    assert 1 <= batch_size(prints) <= search_pieces.MAX_BATCH
