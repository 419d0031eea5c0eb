"""The stages find the same on threads, workers and a cluster, among whole prints and by the index.

What they find is held against plain loops over all prints.
"""

import json
from itertools import product
from math import inf

import numpy as np
import platformdirs
import pytest
from made_prints import FAKE, entries_of, entry_of, scattered, template_at

from fpmatch import identify as identify_in
from fpmatch.formats.files import save_template
from fpmatch.gallery.engine import in_threads
from fpmatch.gallery.engine.engine import dask, processes, serial
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
    GallerySubjects,
    identify_each,
    identify_entries,
    identify_entries_fused,
)
from fpmatch.gallery.search.fused import identify_fused
from fpmatch.gallery.search.identify import compare_probes, identify
from fpmatch.gallery.search.indexed import IndexedSearch
from fpmatch.gallery.search.opening import open_search
from fpmatch.gallery.search.search import SearchOptions
from fpmatch.gallery.search.whole import WholeSearch, piece_size
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.server import gallery as served

SIZE = 60
SHOWN = list(make_templates(5, range(25)))  # with ridges; every third print has none
PRINTS = [one if k % 3 else scattered(k, 30) for k, one in enumerate(SHOWN)]
PROBES = [PRINTS[k] for k in (4, 18, 23, 24)]
KINDS = {
    "all": {"loss": 0},
    "index": {},
}
LISTS = (
    {},
    {"transforms": True},
    {"listed": "impressions", "count": 40},
    {"listed": "subjects", "threshold": 2.0},
)


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


@pytest.mark.slow
def test_candidates_of_a_cluster_are_those_of_one_thread(filled, local_cluster):
    with dask(local_cluster.scheduler_address) as engine:
        for kind, more in product(KINDS.values(), LISTS):
            search, options = opened(filled, kind), kind | more
            made = in_batches(engine, filled, search, SearchOptions(**options))
            assert list(map(repr, made)) == alone(filled, search, options)


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


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_subjects_of_two_fingers_are_those_of_one_thread(filled, helpers, kind, workers):
    search, options = opened(filled, kind), {"positions": ["", ""], **kind}
    probes, subjects = PROBES[:2], GallerySubjects(filled)
    expected = identify_fused(search, probes, subjects, workers=1, **options)
    assert expected.candidates
    assert not helpers
    made = identify_fused(search, probes, subjects, engine=workers, workers=2, **options)
    assert made == expected
    assert identify_fused(search, probes, subjects, workers=2, **options) == expected
    assert helpers
    assert identify_entries_fused(filled, search, probes, **options)[0] == expected


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_probes_are_drawn_as_their_outcomes_are_taken(filled, kind, workers):
    """Each outcome can be written before the next probes are read; a batch has three."""
    search, drawn = opened(filled, kind), []

    def probes():
        for k in range(300):
            drawn.append(k)
            yield PROBES[k % 4]

    for engine, most in ((serial(), 3), (workers, 240)):
        drawn.clear()
        outcomes = identify_each(filled, search, probes(), SearchOptions(**kind), engine)
        assert next(outcomes)[0].candidates
        assert len(drawn) <= most
        outcomes.close()


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


def test_all_segments_are_searched_for_the_share_without_orientation_of_the_whole(
    filled, monkeypatch
):
    """A segment of oriented prints beside one without: each alone would look up other terms."""
    asked = []

    def recorded(probe, budget, unoriented):
        asked.append(unoriented)
        return probe_terms(probe, budget, unoriented=unoriented)

    monkeypatch.setattr(indexed, "probe_terms", recorded)
    monkeypatch.setattr(indexed, "unoriented_share", lambda segments: 0.25 * len(segments))
    search = opened(filled, {})
    for engine in (Threads(2), serial()):
        compared(search, PROBES[0], engine)
    assert asked == 2 * [0.25 * len(search.division(True).pieces)]


def test_other_matchers_are_compared_in_one_thread(gallery, helpers, workers):
    gallery.add(entries_of(*map(template_at, (10, 50, 200, 52, 45))))
    search = open_search(gallery, FAKE)
    for engine in (search.threads(3), serial(), workers):
        listed = compared(search, template_at(50), engine)
        assert listed.similarities.tolist() == [60.0, 100.0, 0.0, 98.0, 95.0]
    assert not helpers


def test_prints_that_cannot_be_sent_are_compared_in_this_process(gallery, workers):
    gallery.add(entries_of(*(scattered(k, 12) for k in range(6))))
    search = open_search(gallery, "paper", engine=serial())
    assert not search.can_be_sent()
    expected = [identify(search, probe) for probe in PROBES]
    made = in_batches(workers, gallery, search, SearchOptions())
    assert [repr(one) for one, _ in made] == list(map(repr, expected))


@pytest.mark.parametrize("limit", [-1, 10], ids=["index", "whole"])
def test_an_empty_gallery_and_no_probes(gallery, monkeypatch, limit):
    monkeypatch.setattr("fpmatch.gallery.search.opening.EXHAUSTIVE_UP_TO", limit)
    search = open_search(gallery, engine=serial())
    assert search.in_stages == (limit < 0)
    for engine in (Threads(2), serial(), processes(2)):
        assert len(compared(search, PROBES[0], engine).similarities) == 0
        with engine:
            assert list(identify_each(gallery, search, [], SearchOptions(), engine)) == []


@pytest.mark.parametrize("prints", [0, 1, 31, 33, 20_000, 100_003])
def test_pieces_cover_all_prints(prints):
    numbers = np.arange(prints)
    search = WholeSearch(FAKE, numbers, numbers, numbers)
    for of_threads in (True, False):
        pieces, sizes, locate = search.division(of_threads)
        covered = [one.prints for one in pieces]
        assert np.concatenate([numbers[:0], *covered]).tolist() == numbers.tolist()
        assert sizes == list(map(len, covered))
        if prints:
            piece, local = locate(numbers)
            assert (piece * sizes[0] + local).tolist() == numbers.tolist()
            assert (
                (len(pieces) == 1) if of_threads else (sizes[0] == min(piece_size(prints), prints))
            )


def test_all_cores_are_the_default(filled, helpers, monkeypatch):
    monkeypatch.setattr(in_threads, "available_cores", lambda: 3)
    identify_entries(filled, open_search(filled, engine=serial()), PROBES[0])
    assert helpers


def test_the_function_and_the_command_take_a_number_of_threads(run, filled, helpers, tmp_path):
    expected = identify_in(filled, PROBES[1], workers=1)
    save_template(tmp_path / "probe.json", PROBES[1])
    words = ["identify", filled.name, str(tmp_path / "probe.json"), "--json", "--workers"]
    documents = []
    for workers in ("1", "2"):
        assert not helpers
        done = run(*words, workers)
        assert done.exit_code == 0, done.output
        documents.append(json.loads(done.stdout))
        del documents[-1]["probes"][0]["seconds"]
    assert helpers
    assert documents[0] == documents[1]
    helpers.clear()
    assert identify_in(filled, PROBES[1], workers=2) == expected
    assert helpers
    with pytest.raises(ValueError, match="workers"):
        identify_in(filled, PROBES[1], workers=0)


def test_the_server_searches_in_one_thread(filled, helpers, monkeypatch):
    """Its workers are processes: as many as there are cores."""

    class Given:
        template, name, notes = PROBES[0], "probe.tif", ()
        dpi_stated, image = True, None

    class Reading:
        class limits:
            candidates = 10

    class Upload:
        data = b"probe"

    monkeypatch.setattr(served, "_kept", {})
    monkeypatch.setattr(served, "open_upload_with_minutiae", lambda *_: Given)
    monkeypatch.setattr(in_threads, "available_cores", lambda: 2)
    answer = served.identify_print(Upload, Reading, filled.name, "unit-circle", 5, 0.0)
    assert len(answer["candidates"]) == 5
    assert not helpers
