"""FNIR and FPIR of a few searches, counted by hand and by trying every threshold."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.lab.evaluation.open_set.rates import open_set_rates
from fpmatch.lab.evaluation.open_set.roles import (
    GROUPS,
    Roles,
    group_fingers,
    subject_of,
)
from fpmatch.lab.evaluation.open_set.searches import (
    LIST_LENGTH,
    NO_CHANCE,
    NO_SCORE,
    NOT_LISTED,
    Searches,
)


def chance_of(scores, enrolled=10):
    """Return how many others are expected by chance, by the FMR alone."""
    given = np.array(scores, float)
    return np.where(given == NO_SCORE, NO_CHANCE, enrolled * 10 ** (-0.1 * given))


def searches_of(scores, ranks, highest, enrolled=10):
    return Searches(
        mated=np.arange(len(scores)),
        mate=np.arange(len(scores)),
        score=np.array(scores, float),
        rank=np.array(ranks, int),
        chance=chance_of(scores, enrolled),
        nonmated=np.arange(len(highest)),
        highest=np.array(highest, float),
        least_chance=chance_of(highest, enrolled),
        first=np.arange(len(highest)),
        enrolled=np.full(3, enrolled),
    )


def rates_of(searches, **options):
    most = max(len(searches.mated), len(searches.nonmated))
    return open_set_rates(searches, np.arange(most), **options)


def test_rates_of_a_few_searches_counted_by_hand():
    searches = searches_of(
        [50.0, 40.0, 30.0, NO_SCORE], [1, 1, 3, NOT_LISTED], [10.0, 20.0, 35.0, 45.0]
    )
    rates = rates_of(searches, fpirs=[0.25, 0.5, 0.75, 0.1])
    # one of four may have a candidate: the threshold lies above 35: 50 and 40 are found
    assert [point.fnir for point in rates.points] == [0.5, 0.25, 0.25, None]
    least = chance_of([35.0, 20.0, 10.0])
    assert [point.by_chance for point in rates.points] == [*map(pytest.approx, least), None]
    assert [point.false_positives for point in rates.points] == [1, 2, 3, None]
    assert rates.fnir_at_rank[:4] == (0.5, 0.5, 0.25, 0.25)
    assert len(rates.fnir_at_rank) == LIST_LENGTH
    assert (rates.mated, rates.nonmated) == (4, 4)
    assert all(point.interval is None for point in rates.points)


SCORE = st.integers(0, 20).map(float)
MATE = st.one_of(st.tuples(SCORE, st.integers(1, 100)), st.just((NO_SCORE, NOT_LISTED)))


@given(
    st.lists(MATE, min_size=1, max_size=12),
    st.lists(st.one_of(SCORE, st.just(NO_SCORE)), min_size=1, max_size=12),
)
def test_agrees_with_trying_every_threshold(mates, highest):
    scores, ranks = np.array(mates).T
    fpirs = np.linspace(0.05, 0.95, 19)
    rates = rates_of(searches_of(scores, ranks, highest), fpirs=fpirs)
    thresholds = [*np.arange(0, 22) - 0.5]
    for point in rates.points:
        if point.fpir * len(highest) < 1 - 1e-9:
            assert point.fnir is None
            continue
        allowed = [t for t in thresholds if np.mean(np.array(highest) >= t) <= point.fpir + 1e-9]
        assert point.fnir == pytest.approx(min(np.mean(scores < t) for t in allowed))
    for rank, fnir in enumerate(rates.fnir_at_rank, start=1):
        assert fnir == pytest.approx(np.mean(ranks > rank))
    known = [point.fnir for point in rates.points if point.fnir is not None]
    assert known == sorted(known, reverse=True)
    assert list(rates.fnir_at_rank) == sorted(rates.fnir_at_rank, reverse=True)
    stated = [point.stated_fnir for point in rates.points]
    assert stated == sorted(stated, reverse=True)


def test_intervals_contain_the_rates_and_need_five_subjects():
    rng = np.random.default_rng(0)
    scores = rng.uniform(20, 60, 200)
    searches = searches_of(scores, np.where(scores < 25, 2, 1), rng.uniform(0, 30, 400))
    subject = np.arange(400) // 10
    draws = rng.multinomial(40, np.full(40, 1 / 40), size=300)
    rates = open_set_rates(searches, subject, draws=draws)
    for point in (*rates.points[1:], *rates.det):
        assert point.interval.low <= point.fnir <= point.interval.high
    assert rates.points[0].interval is None  # of 400 searches, not one may have a candidate
    low, high = rates.rank_intervals[0]
    assert low < rates.fnir_at_rank[0] < high
    few = np.where(np.arange(40) < 4, draws, 0)
    none = open_set_rates(searches, subject, draws=few)
    assert all(point.interval is None for point in none.points if point.fnir)
    assert none.rank_intervals[0] is None
    assert none.fnir_at_rank[1] == 0


def test_a_database_without_mates_has_no_fnir():
    rates = rates_of(searches_of([], [], [1.0, 2.0]), fpirs=[0.5])
    assert rates.points[0].fnir is None
    assert rates.points[0].stated_fnir is None
    assert rates.fnir_at_rank == ()


SIZES = st.lists(st.lists(st.integers(1, 5), min_size=1, max_size=6), min_size=1, max_size=3)


def searches(roles):
    """Yield probe, mate (None: none is enrolled) and the enrolled of each search, by definition."""
    for turn in range(roles.turns):
        for group in range(GROUPS):
            enrolled = roles.enrolled(group, turn).tolist()
            for probe in range(len(roles.subject)):
                if roles.is_searched(probe, turn) and probe not in enrolled:
                    of_probe = [e for e in enrolled if roles.subject[e] == roles.subject[probe]]
                    yield probe, of_probe[0] if of_probe else None, enrolled


@given(st.integers(3, 9), st.integers(2, 6), st.integers(0, 9))
def test_a_third_of_the_searches_have_a_mate_and_each_pair_comes_once(subjects, size, seed):
    roles = Roles.draw([[size] * subjects], seed)
    mates = Counter((probe, mate) for probe, mate, _ in searches(roles))
    pairs = {
        (p, m)
        for p in range(subjects * size)
        for m in range(subjects * size)
        if p != m and p // size == m // size
    }
    assert {pair for pair in mates if pair[1] is not None} == pairs
    assert all(mates[pair] == 1 for pair in pairs)
    without = sum(number for (_, mate), number in mates.items() if mate is None)
    assert without == 2 * len(pairs)


@given(SIZES, st.integers(0, 3))
def test_nobody_is_enrolled_and_searched_for_by_one_print(sizes, seed):
    roles = Roles.draw(sizes, seed)
    count = sum(map(len, sizes))
    assert sorted(np.bincount(roles.group, minlength=GROUPS)) == sorted(
        len(part) for part in np.array_split(np.arange(count), GROUPS)
    )
    every = [roles.enrolled(g, t).tolist() for g in range(GROUPS) for t in range(roles.turns)]
    assert {e for enrolled in every for e in enrolled} == set(range(len(roles.subject)))
    for probe, mate, enrolled in searches(roles):
        assert probe not in enrolled
        assert len({roles.subject[e] for e in enrolled}) == len(enrolled)
        assert mate is None or mate in enrolled


def test_fingers_of_a_subject_stay_together_and_the_rest_are_paired():
    assert subject_of("ada/left") == "ada"
    assert subject_of(101) is None
    assert subject_of("101") is None
    names = ["ada", "bob", "ada", "bob", "cy", None, None]
    assert group_fingers(names, 2) == [(0, 2), (1, 3), (4, 5)]
    assert group_fingers(names, 1) == [(k,) for k in range(7)]
    assert group_fingers(names, 8) == []


@given(st.lists(st.one_of(st.none(), st.integers(0, 3)), max_size=12), st.integers(1, 4))
def test_a_finger_is_in_one_group_at_most(subjects, size):
    groups = group_fingers(subjects, size)
    used = [finger for group in groups for finger in group]
    assert len(used) == len(set(used)) == len(subjects) - len(subjects) % size
    assert all(len(group) == size for group in groups)
