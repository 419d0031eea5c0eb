from collections import Counter

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.lab.evaluation.open_set.roles import (
    GROUPS,
    MOST_TURNS,
    Roles,
    group_fingers,
    subject_of,
)

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


def test_the_same_seed_draws_the_same_groups_and_another_others():
    first, again, other = (Roles.draw([[2] * 30], seed).group for seed in (0, 0, 1))
    assert (first == again).all()
    assert (first != other).any()


def test_of_many_impressions_some_take_turns():
    roles = Roles.draw([[MOST_TURNS + 5, 2, 1]])
    assert roles.turns == MOST_TURNS


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
