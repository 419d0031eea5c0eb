"""Searches in stages by segments that workers hold: candidates of one search, to the last bit."""

from __future__ import annotations

import platformdirs
import pytest
from made_prints import entry_of, scattered

from fpmatch.engine.engine import processes, serial
from fpmatch.gallery import indexed_pieces, indexed_search
from fpmatch.gallery.candidates import GallerySubjects
from fpmatch.gallery.entry import Label
from fpmatch.gallery.identify import identify
from fpmatch.gallery.identify_fused import identify_fused
from fpmatch.gallery.indexed_search import IndexedSearch
from fpmatch.gallery.search import open_search
from fpmatch.gallery.search_pieces import hold_search
from fpmatch.indexing import stages
from fpmatch.indexing.loss import SearchPlan

SIZE = 60
PROBES = [scattered(k, 30) for k in (3, 17, 44, 1000)]


@pytest.fixture(autouse=True)
def small_limits(tmp_path, monkeypatch):
    """Index galleries of more than ten prints in segments of few; pass few on, with many ties."""
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda name: tmp_path / "cache" / name)
    for name in ("search", "prepared_search"):
        monkeypatch.setattr(f"fpmatch.gallery.{name}.LISTED_UP_TO", 10)
    monkeypatch.setattr("fpmatch.matching.prints.candidate_list.LEAST_PRINTS", 5)
    for owner in (indexed_search, indexed_pieces):
        monkeypatch.setattr(owner, "search_plan", plan_of)


def plan_of(loss, prints, threshold):
    return SearchPlan(loss, 0.5, 15 if threshold else 25, 7)


@pytest.fixture
def search(gallery):
    """Return a search by an index of several segments, of which prints were removed."""
    made = None
    for first in range(0, SIZE, 20):
        numbers = range(first, min(first + 20, SIZE))
        labels = [Label(str(k // 2), impression=str(k % 2)) for k in numbers]
        # some prints are equal: they have the same votes and scores
        prints = [scattered(k % 23, 30) for k in numbers]
        gallery.add(
            [entry_of(k, one, label) for k, one, label in zip(numbers, prints, labels, strict=True)]
        )
        made = open_search(gallery, engine=serial(), before=made)
        assert len(made)
    gallery.remove([5, 30, 31])
    found = open_search(gallery, engine=serial(), before=made)
    assert isinstance(found, IndexedSearch)
    assert len(found.state.segments) > 1
    return found


def outcome(result):
    return (
        repr(result.candidates),
        result.enrolled,
        result.compared,
        result.fingers,
        result.loss,
        result.passed_on,
    )


def test_all_segments_are_searched_for_the_share_without_orientation_of_the_whole(
    search, monkeypatch
):
    """A segment of oriented prints beside one without: each alone would look up other terms."""
    asked = []
    probe_terms = stages.probe_terms

    def recorded(*arguments, unoriented):
        asked.append(unoriented)
        return probe_terms(*arguments, unoriented=unoriented)

    monkeypatch.setattr(stages, "probe_terms", recorded)
    monkeypatch.setattr(stages, "unoriented_share", lambda segments: 0.25 * len(segments))
    monkeypatch.setattr(indexed_pieces, "unoriented_share", stages.unoriented_share)
    expected = outcome(identify(search, PROBES[0]))
    prepared = search.matcher.prepare(PROBES[0])
    with serial() as engine, hold_search(engine, search) as held:
        ((answer,),) = held.answers([[prepared]])
        found = outcome(identify(held.answered(answer), PROBES[0]))
    assert found == expected
    assert set(asked) == {0.25 * len(search.state.segments)}


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("options", [{"count": 2}, {"count": 10, "threshold": 30.0}, {"count": 40}])
def test_candidates_are_those_of_one_search(search, workers, options):
    expected = [outcome(identify(search, probe, **options)) for probe in PROBES]
    prepared = [search.matcher.prepare(probe) for probe in PROBES]
    batches = [prepared[:3], prepared[3:]]
    with processes(workers) as engine, hold_search(engine, search) as held:
        answers = [one for batch in held.answers(batches, **options) for one in batch]
        found = [
            outcome(identify(held.answered(answer), probe, **options))
            for answer, probe in zip(answers, PROBES, strict=True)
        ]
    assert found == expected


@pytest.mark.parametrize("candidate_list", ["auto", 8, "off"])
def test_subjects_of_two_fingers_are_those_of_one_search(search, gallery, candidate_list):
    options = {"positions": ["", ""], "candidate_list": candidate_list, "count": 4}
    probes, subjects = PROBES[:2], GallerySubjects(gallery)
    expected = identify_fused(search, probes, subjects, **options)
    found = identify_fused(search, probes, subjects, engine=processes(2), **options)
    assert expected.candidates
    assert found == expected


def test_other_lists_are_made_of_whole_templates(search):
    prepared = [search.matcher.prepare(PROBES[0])]
    for candidate_list in (8, "off"):
        options = {"candidate_list": candidate_list}
        with serial() as engine, hold_search(engine, search, candidate_list) as held:
            ((answer,),) = held.answers([prepared], **options)
            found = identify(held.answered(answer), PROBES[0], **options)
        assert outcome(found) == outcome(identify(search, PROBES[0], **options))


def test_removed_prints_are_not_found(search):
    prepared = [search.matcher.prepare(scattered(k % 23, 30)) for k in (4, 29, 30)]
    with serial() as engine, hold_search(engine, search) as held:
        (answers,) = held.answers([prepared])
        for answer in answers:
            found = identify(held.answered(answer), scattered(4, 30))
            assert {5, 30, 31}.isdisjoint(one.number for one in found.candidates)
