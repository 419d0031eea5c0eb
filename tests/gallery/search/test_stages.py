"""The stages find the same on threads, workers and a cluster, among whole prints and by the index.

What they find is held against plain loops over all prints.
"""

from math import inf

import numpy as np
import platformdirs
import pytest
from made_prints import entry_of, scattered

from fpmatch.gallery.engine.engine import processes, serial
from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.index import loss
from fpmatch.gallery.index.loss import SearchPlan, chosen_by_ridges, combined_scores
from fpmatch.gallery.index.prints.compare import ridge_agreement
from fpmatch.gallery.index.stages import unoriented_share
from fpmatch.gallery.index.terms import probe_terms
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search import indexed, whole
from fpmatch.gallery.search.entries import (
    identify_each,
    identify_entries,
)
from fpmatch.gallery.search.identify import compare_probes
from fpmatch.gallery.search.indexed import IndexedSearch
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.search.search import SearchOptions
from fpmatch.lab.synthesis.templates import make_templates

SIZE = 60
SHOWN = list(make_templates(5, range(25)))  # with ridges; every third print has none
PRINTS = [one if k % 3 else scattered(k, 30) for k, one in enumerate(SHOWN)]
PROBES = [PRINTS[k] for k in (4, 18, 23, 24)]
KINDS = {
    "all": {"loss": 0},
    "index": {},
}
LISTS = ({"listed": "impressions", "count": 40}, {"listed": "subjects", "threshold": 2.0})


def plan_of(loss, prints, threshold):
    return SearchPlan(loss, 0.5, 15 if threshold else 25, 9)


def rounds_of(loss, prints, threshold, all_mates):
    return [(plan_of(loss, prints, threshold), inf)]


@pytest.fixture(scope="module", autouse=True)
def small_parts(tmp_path_factory):
    """Index galleries of more than ten prints; give each thread and worker few; ties are many."""
    cache = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(platformdirs, "user_cache_path", lambda name: cache / name)
        patch.setattr(whole, "MIN_PIECE", 1)
        patch.setattr(whole, "COMPARED_AT_ONCE", 3)
        patch.setattr(indexed, "PRINTS_AT_ONCE", 4)
        patch.setattr(indexed, "PREPARED_AT_ONCE", 2)
        patch.setattr("fpmatch.gallery.search.opening.EXHAUSTIVE_UP_TO", 10)
        patch.setattr("fpmatch.gallery.search.entries.MAX_BATCH", 3)
        patch.setattr("fpmatch.gallery.index.prints.descriptor_scores.LEAST_PRINTS", 5)
        patch.setattr(indexed, "search_rounds", rounds_of)
        patch.setattr(loss, "LEAST_BY_RIDGES", 4)
        yield


@pytest.fixture(scope="module")
def filled(small_parts, tmp_path_factory):
    """Return a gallery whose index has several segments, without three prints of them."""
    with open_gallery(tmp_path_factory.mktemp("filled") / "g.db", create=True) as gallery:
        for first in range(0, SIZE, 20):
            labels = [Label(str(k // 2), impression=str(k % 2)) for k in range(first, first + 20)]
            # some prints are equal: they have the same votes and scores
            gallery.add(
                [entry_of(k, PRINTS[k % 23], label) for k, label in enumerate(labels, start=first)]
            )
            assert len(open_search(gallery, engine=serial()))
        gallery.remove([5, 30, 31])
        yield gallery


@pytest.fixture(scope="module")
def workers():
    with processes(2) as engine:
        yield engine


@pytest.fixture
def helpers(monkeypatch):
    """Return a list of the threads that begin to help a search."""
    begun, start = [], Threads._start
    monkeypatch.setattr(
        Threads, "_start", lambda self, work: begun.append(self) or start(self, work)
    )
    return begun


def opened(gallery, kind):
    search = open_search(gallery, engine=serial(), **kind)
    assert isinstance(search, IndexedSearch) == (not kind)
    assert not isinstance(search, IndexedSearch) or len(search.division(True).pieces) > 1
    return search


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_candidates_are_those_of_one_thread(filled, helpers, kind, workers):
    search = opened(filled, kind)
    for more in LISTS:
        helpers.clear()
        options = kind | more
        expected = alone(filled, search, options)
        assert not helpers
        made = [identify_entries(filled, search, p, workers=3, **options) for p in PROBES]
        assert helpers
        assert list(map(repr, made)) == expected
        for engine in (serial(), workers):
            made = in_batches(engine, filled, search, SearchOptions(**options))
            assert list(map(repr, made)) == expected


def alone(gallery, search, options):
    """Return what one thread finds for the probes, in words; none of it was removed."""
    found = [identify_entries(gallery, search, p, workers=1, **options) for p in PROBES]
    assert any(result.candidates for result, _ in found)
    assert not {5, 30, 31} & {c.number for result, _ in found for c in result.candidates}
    return list(map(repr, found))


def in_batches(engine, gallery, search, options):
    """Return what is found for the probes, with one among them that has no template."""
    probes = iter([*PROBES[:2], None, *PROBES[2:]])
    one, two, nothing, *others = identify_each(gallery, search, probes, options, engine)
    assert nothing is None
    return [one, two, *others]


def compared(search, probe, engine, **options):
    (one,) = compare_probes(search, [probe], SearchOptions(**options), engine)
    return one.listed


@pytest.mark.parametrize(("probe", "count"), [*zip(PROBES, [1, 10, 10, 1], strict=True)])
def test_the_index_passes_on_what_a_loop_over_all_its_prints_does(filled, probe, count):
    search = opened(filled, {})
    prepared, plan = search.matcher.prepare(probe), plan_of(0.01, SIZE, 0.0)
    unoriented = unoriented_share([segment.terms for segment in search.state.segments])
    terms = probe_terms(prepared, plan.budget, unoriented=unoriented)
    rows = []
    for segment in search.state.segments:
        scores = segment.descriptors.scores(prepared)
        columns = segment.numbers, segment.terms.votes(terms), scores, segment.descriptors.size
        rows += zip(*(one.tolist() for one in columns), strict=True)
    rows = [row for row in rows if row[0] not in {5, 30, 31}]
    rows = sorted(rows, key=lambda row: (-row[1], row[0]))[: plan.by_terms]
    number, votes, scores, sizes = (np.array(column) for column in zip(*rows, strict=True))
    combined = combined_scores(scores, sizes, votes, len(prepared))
    best = np.lexsort((number, -combined))[: max(plan.by_descriptors, count)]
    best = best[np.argsort(number[best])]
    agreement = np.full(len(number), np.nan)
    for segment in search.state.segments:
        inside = np.flatnonzero(np.isin(segment.numbers, number[best]))
        of = ridge_agreement(prepared, segment.descriptors, segment.templates, inside)
        for n, one in zip(segment.numbers[inside], of, strict=True):
            agreement[number == n] = one
    most = max(plan.by_ridges, count)
    passed_on = number[best[chosen_by_ridges(combined[best], agreement[best], most)]]
    listed = compared(search, probe, Threads(1), count=count)
    assert listed.passed_on == (25, len(best), len(passed_on))
    first = np.isin(search.numbers[listed.compared], passed_on)
    order = np.argsort(-listed.similarities[first], kind="stable")
    best = search.fingers[listed.compared[first][order[:count]]]
    others = np.flatnonzero(np.isin(search.fingers, best))
    chosen = search.places_of(passed_on.tolist())
    assert listed.compared.tolist() == np.union1d(chosen, others).tolist()
    compare = search.matcher.compare
    assert listed.similarities.tolist() == [
        compare(prepared, search.print_at(k)).similarity for k in listed.compared.tolist()
    ]


@pytest.mark.parametrize("limit", [-1, 10], ids=["index", "whole"])
def test_an_empty_gallery_and_no_probes(gallery, monkeypatch, limit):
    monkeypatch.setattr("fpmatch.gallery.search.opening.EXHAUSTIVE_UP_TO", limit)
    search = open_search(gallery, engine=serial())
    assert search.in_stages == (limit < 0)
    for engine in (Threads(2), serial(), processes(2)):
        assert len(compared(search, PROBES[0], engine).similarities) == 0
        with engine:
            assert list(identify_each(gallery, search, [], SearchOptions(), engine)) == []
