"""The ranks of an identification are those of comparing one by one."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_prints import FAKE, entries_of, scattered, template_at

from fpmatch.errors import MatcherError
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.fingers.finger import fused_score
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search.identification import expected_by_chance
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.search import Search
from fpmatch.matching.calibration import Calibration
from fpmatch.matching.verify import verify

TEN_PER_TEN = Calibration(((0.0, 0.0), (100.0, 100.0)), tail_scale=1.0)


def identify_at(search, x, **options):
    return identify(search, template_at(x), calibration=TEN_PER_TEN, **options)


def numbers_of(result):
    return [candidate.number for candidate in result.candidates]


@pytest.fixture
def fill(gallery):
    """Return a function that makes a search of the prints that a fake matcher knows by numbers."""

    def made(*numbers, **options):
        gallery.add(entries_of(*map(template_at, numbers), **options))
        return Search(gallery, FAKE)

    return made


def test_the_most_similar_come_first_with_their_rates(fill):
    search = fill(10, 50, 200, 52, 45)
    result = identify_at(search, 50, count=3)
    assert (result.compared, result.matcher) == (5, "fake")
    assert [(c.rank, c.number, c.similarity) for c in result.candidates] == [
        (1, 2, 100.0),
        (2, 4, 98.0),
        (3, 5, 95.0),
    ]
    third = result.candidates[2]
    assert third.score == pytest.approx(95.0)
    assert third.fmr == pytest.approx(10**-9.5)
    assert third.expected_false == pytest.approx(5 * 10**-9.5)
    assert third.comparison is None
    assert numbers_of(identify_at(search, 50, threshold=98.0)) == [2, 4]
    assert len(identify_at(search, 50).candidates) == 5


def test_of_equals_the_first_enrolled_comes_first(fill):
    assert numbers_of(identify_at(fill(7, 3, 7, 3, 7, 3), 5, count=4)) == [1, 2, 3, 4]


def test_a_subject_is_a_candidate_once_by_its_best_finger(gallery):
    labels = [("ada", "left", "1"), ("ada", "right", "1"), ("bob", "1", "1"), ("ada", "right", "2")]
    templates = map(template_at, (40, 48, 45, 49))
    entries = [
        replace(entry, label=Label(*label))
        for entry, label in zip(entries_of(*templates), labels, strict=True)
    ]
    gallery.add(entries)
    search = Search(gallery, FAKE)

    def found(**options):
        return numbers_of(identify_at(search, 50, **options))

    assert found(listed="subjects") == [4, 3]
    assert found(listed="subjects", count=1) == [4]
    assert found() == [4, 3, 1]
    once, each = (identify_at(search, 50, **o).candidates for o in ({"listed": "subjects"}, {}))
    assert once == each[:2]


def test_an_empty_gallery_has_no_candidate(fill):
    result = identify_at(fill(), 50)
    assert (result.compared, result.candidates) == (0, ())


@pytest.mark.parametrize(
    "wrong",
    [
        *({"count": 0}, {"threshold": -1.0}, {"threshold": 101.0}),
        *({"effort": 0}, {"effort": 3}, {"effort": float("nan")}),
    ],
)
def test_what_is_out_of_range_is_refused(fill, wrong):
    with pytest.raises(MatcherError):
        identify_at(fill(1), 50, **wrong)


def test_scores_are_those_of_verify_on_the_enrolled_templates(gallery, template):
    gallery.add(entries_of(template))
    result = identify(Search(gallery), template, transforms=True)
    expected = verify(template, gallery.template(1))
    (candidate,) = result.candidates
    assert (candidate.score, candidate.fmr) == (expected.score, expected.fmr)
    assert candidate.comparison.transform == expected.transform
    assert result.smallest_measured_fmr == expected.smallest_measured_fmr


@pytest.fixture
def search(gallery):
    """Return a search of 12 prints, whose numbers are those of their seeds."""
    gallery.add(entries_of(*map(scattered, range(1, 13))))
    return Search(gallery, engine=serial())


def test_chance_is_measured_by_the_fifth_best_of_the_others():
    scores = np.array([70.0, 41.0, 35.0, 33.0, 31.0, 30.0, 12.0, 3.0])
    chance = expected_by_chance(scores, 10**6)
    # five others score 30, ten points higher a tenth of them; of the sixth, five score 31
    assert chance[:2] == pytest.approx([5e-4, 5 * 10**-1.1])
    assert chance[5] == pytest.approx(5 * 10**0.1)
    # never more than by the FMR; as many of a few
    assert expected_by_chance(scores, 8) == pytest.approx(8 * 10 ** (-scores / 10))
    assert expected_by_chance(scores[:5], 10**6) == pytest.approx(10 ** (6 - scores[:5] / 10))
    # five that are not similar at all are no measure
    zeros = [50.0, *[0.0] * 9]
    assert expected_by_chance(zeros, 1000)[0] == pytest.approx(0.01)
    assert expected_by_chance([], 9).size == 0


@given(st.lists(st.floats(0, 100), max_size=20), st.integers(1, 10**9), st.randoms())
def test_chance_falls_with_the_score_whatever_the_order(scores, among, rng):
    chance = expected_by_chance(scores, among)
    assert (chance <= among * 10 ** (-np.array(scores, float) / 10) * (1 + 1e-9)).all()
    order = np.argsort(scores, kind="stable")
    assert (np.diff(chance[order]) <= 1e-9 * chance[order][:-1]).all()
    mixed = rng.sample(range(len(scores)), len(scores))
    again = expected_by_chance([scores[k] for k in mixed], among)
    assert again.tolist() == chance[mixed].tolist()


def test_candidates_that_chance_explains_are_left_out(search):
    every = identify(search, scattered(7)).candidates
    few = identify(search, scattered(7), by_chance=1e-3).candidates
    assert few == tuple(one for one in every if one.expected_false < 1e-3)
    assert [one.number for one in few] == [7]
    with pytest.raises(MatcherError, match="the number by chance is over 0, not -1"):
        identify(search, scattered(7), by_chance=-1.0)


@pytest.fixture
def fingers(fill):
    """Return a search of finger a with three impressions and b and c of the same subject."""
    labels = [("x", "a", "1"), ("x", "b", "1"), ("x", "a", "2"), ("x", "c", "1"), ("x", "a", "3")]
    return fill(10, 50, 52, 90, 55, labels=[Label(*label) for label in labels])


def test_a_finger_comes_once_by_the_score_of_its_impressions(fingers):
    found = identify_at(fingers, 52)
    assert (found.enrolled, found.fingers) == (5, 3)
    assert [(c.number, c.impressions) for c in found.candidates] == [(2, 1), (3, 3), (4, 1)]
    finger = found.candidates[1]
    assert finger.score == pytest.approx(fused_score([58.0, 100.0, 97.0]))
    assert (finger.similarity, finger.impression_score) == (100.0, 100.0)
    assert finger.expected_false == pytest.approx(3 * finger.fmr)
