import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from truth_files import truth_of

from fpmatch.lab.evaluation.ground_truth.minutiae_counts import (
    TOLERANCES,
    Cause,
    MinutiaeCounts,
    Tolerance,
    assign_minutiae,
    count_minutiae,
    differences,
    false_minutiae,
)
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

SEEN = np.array([True])
CLOSE = Tolerance(10.0, 0.5)


def row(*x, kind=1, angle=0.0):
    """Return minutiae on a line, all of one direction and kind."""
    n = len(x)
    return Minutiae(x=list(x), y=[0.0] * n, angle=[angle] * n, kind=[kind] * n)


def all_seen(minutiae):
    return np.ones(len(minutiae), bool)


@pytest.mark.parametrize(
    ("dx", "turn", "right"),
    [(0, 0, 1), (10, 0, 1), (10.1, 0, 0), (0, 0.49, 1), (0, 0.51, 0), (0, 2 * math.pi - 0.4, 1)],
)
def test_a_pair_lies_within_both_tolerances(dx, turn, right):
    expected = MinutiaeCounts(right, 1 - right, 1 - right)
    assert count_minutiae(row(dx, angle=1 + turn), row(0, angle=1), SEEN, CLOSE) == expected
    assert [str(t) for t in TOLERANCES] == ["16 px, 30°", "12 px, 22.5°", "8 px, 18°"]


def test_more_pairs_come_before_near_ones_and_these_before_the_rest():
    assert assign_minutiae(row(4, 1, 3), row(0), SEEN, CLOSE).tolist() == [[1, 0]]
    # Nearest first would give 0 to 2, and leave -9 and 10 alone.
    pairs = assign_minutiae(row(0, 10), row(-9, 2), np.ones(2, bool), CLOSE)
    assert pairs.tolist() == [[0, 0], [1, 1]]
    true = Minutiae(x=[-3, 3], y=[0, 0], angle=[0.2, 0.0])  # the direction decides
    assert assign_minutiae(row(0), true, all_seen(true), CLOSE).tolist() == [[0, 1]]


def test_counts_add_up_to_shares_and_nothing_has_none():
    nothing = Minutiae.empty()
    assert count_minutiae(nothing, row(0), SEEN) == MinutiaeCounts(false_negatives=1)
    assert count_minutiae(row(0), nothing, SEEN[:0]) == MinutiaeCounts(false_positives=1)
    none = count_minutiae(nothing, nothing, SEEN[:0])
    assert none == MinutiaeCounts()
    assert all(map(math.isnan, (none.precision, none.recall, none.f1)))
    total = MinutiaeCounts(5, 2, 1, 3) + MinutiaeCounts(1, 0, 1, 0)
    assert total == MinutiaeCounts(6, 2, 2, 3)
    assert (total.precision, total.recall, total.f1) == (0.75, 0.75, 0.75)
    assert (total.extracted, total.true) == (11, 8)


def some_minutiae(rng, n):
    return Minutiae(rng.uniform(0, 30, n), rng.uniform(0, 30, n), rng.uniform(0, 7, n))


@given(st.integers(0, 2**32 - 1), st.integers(0, 5), st.integers(0, 5))
def test_no_other_assignment_is_better(seed, n, m):
    """Every one-to-one assignment is tried, and ranked by what the docstring says."""
    rng = np.random.default_rng(seed)
    found, true, visible = some_minutiae(rng, n), some_minutiae(rng, m), rng.random(m) < 0.6
    wide = Tolerance(20.0, 1.5)
    distance, turn = differences(found, true)

    def rank(pairs):
        seen = sum(bool(visible[j]) for _, j in pairs)
        apart = sum((distance[p] / 20.0) ** 2 + (turn[p] / 1.5) ** 2 for p in pairs)
        return (-seen, -len(pairs), float(apart))

    partners = itertools.permutations([*range(m), *[-1] * n], n)
    possible = ([(i, j) for i, j in enumerate(chosen) if j >= 0] for chosen in set(partners))
    allowed = [
        pairs for pairs in possible if all(distance[p] <= 20 and turn[p] <= 1.5 for p in pairs)
    ]
    got = rank([(int(i), int(j)) for i, j in assign_minutiae(found, true, visible, wide)])
    best = min(map(rank, allowed))
    assert got[:2] == best[:2]
    assert got[2] == pytest.approx(best[2])


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_what_agrees_with_itself_does_so_wholly(seed, count):
    minutiae = some_minutiae(np.random.default_rng(seed), count)
    for tolerance in TOLERANCES:
        counts = count_minutiae(minutiae, minutiae, all_seen(minutiae), tolerance, with_kind=True)
        assert counts == MinutiaeCounts(true_positives=count)


TRUE = Minutiae(x=[100, 150], y=[100, 100], angle=[1.0, 1.0])


def template(*xy_angle, dpi=500.0):
    """Return a template of 200 x 200 px whose ridges end at x = 160."""
    mask = np.zeros((10, 10), bool)
    mask[:, :8] = True
    x, y, angle = np.array(xy_angle, dtype=np.float64).reshape(-1, 3).T
    field = RidgeField(20.0, np.zeros(mask.shape, np.float32), mask)
    return Template(Minutiae(x, y, angle), 200, 200, dpi, field)


def cause_of(x, y, angle=1.0, hidden=None):
    """Return the cause of one minutia beside one that is right."""
    found = template((100, 100, 1.0), (x, y, angle))
    return false_minutiae(found, truth_of(TRUE, hidden=hidden)).get(1)


@pytest.mark.parametrize(
    ("minutia", "cause"),
    [
        ((141, 100), None),
        ((141, 100, 4.0), Cause.DIRECTION),
        ((105, 100, 4.0), Cause.NEAR_ANOTHER),  # the true one there is taken
        # near the border of the image or of its ridges
        *(
            ((x, y), Cause.BORDER)
            for x, y in ((60, 17), (17, 60), (60, 184), (145, 150), (170, 60))
        ),
        ((60, 60, 1.0, [[60, 80]]), Cause.NO_RIDGES),  # a hidden one
        ((60, 60, 1.0, [[60, 150]]), Cause.OTHER),
        ((100, 109.5), Cause.NEAR_ANOTHER),
        ((100, 110.5), Cause.OTHER),
    ],
)
def test_each_cause_is_seen_where_it_is(minutia, cause):
    assert cause_of(*minutia) is cause
