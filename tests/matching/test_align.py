"""Global match: known transforms come back, pairs are one to one, skin that bends is followed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matching_prints import (
    COMPILED,
    Points,
    any_points,
    heaviest,
    jittered,
    moved,
    seeds,
    spread_points,
)
from numpy.typing import NDArray

from fpmatch.matching._align_kernel import LightTable
from fpmatch.matching.align import Alignment, AlignmentParameters, candidates
from fpmatch.matching.local import local_likeness, most_alike
from fpmatch.matching.neighbourhood import neighbourhoods

EXAMPLES = 30 if COMPILED else 8
APART = 25.0  # px between minutiae, more than any reach: only true partners can be paired

turns = st.floats(-math.pi, math.pi)
shifts = st.complex_numbers(max_magnitude=300)
scales = st.floats(0.97, 1.03)


def aligned(
    a: Points, b: Points, parameters: AlignmentParameters | None = None
) -> Alignment | None:
    """Align two prints from the seeds that their neighbourhoods propose."""
    likeness = local_likeness(neighbourhoods(a), neighbourhoods(b))
    return heaviest(a, b, most_alike(likeness), parameters)


def seeds_of(*pairs: tuple[int, int]) -> NDArray[np.int32]:
    return np.array(pairs, np.int32).reshape(-1, 2)


def distances(found: Alignment, a: Points, b: Points) -> NDArray[np.float64]:
    """Return how far apart the paired minutiae lie under the similarity transform alone."""
    linear = found.transform[0] + 1j * found.transform[1]
    shift = found.transform[2] + 1j * found.transform[3]
    i = np.flatnonzero(found.partner >= 0)
    j = found.partner[i]
    return np.abs(shift + linear * (a[0, i] + 1j * a[1, i]) - (b[0, j] + 1j * b[1, j]))


@given(seeds, turns, shifts, scales)
@settings(max_examples=EXAMPLES)
def test_an_unworn_print_comes_back_exactly(
    seed: int, turn: float, shift: complex, scale: float
) -> None:
    a = spread_points(np.random.default_rng(seed), 20, APART)
    b = moved(a, turn, shift, scale)
    found = aligned(a, b)
    assert found is not None
    assert found.partner.tolist() == list(range(20))
    assert found.weight == pytest.approx(1.0)
    assert found.bent == pytest.approx(b, abs=1e-6)
    assert found.transform[0] + 1j * found.transform[1] == pytest.approx(
        scale * np.exp(1j * turn), abs=1e-9
    )
    assert found.transform[2] + 1j * found.transform[3] == pytest.approx(shift, abs=1e-6)


@given(seeds, turns, shifts, scales)
@settings(max_examples=EXAMPLES)
def test_lost_spurious_and_jittered_minutiae_are_borne(
    seed: int, turn: float, shift: complex, scale: float
) -> None:
    rng = np.random.default_rng(seed)
    every = spread_points(rng, 32, APART, size=320.0)
    a = every[:, :26].copy()  # 22 shared, 4 of its own
    kept = np.r_[0:22, 26:32]  # 22 shared, 6 others
    b = jittered(rng, moved(every[:, kept], turn, shift, scale), 1.0, 0.05)
    found = aligned(a, b)
    assert found is not None
    right = found.partner[:22] == np.arange(22)
    assert right.sum() >= 20
    assert np.count_nonzero(found.partner >= 0) <= right.sum() + 2
    truth = moved(a, turn, shift, scale)
    linear = found.transform[0] + 1j * found.transform[1]
    assert abs(np.angle(linear * np.exp(-1j * turn))) < np.radians(1.5)
    assert abs(linear) == pytest.approx(scale, abs=0.02)
    off = found.bent[:2, :22] - truth[:2, :22]
    assert np.sqrt((off**2).sum(axis=0).mean()) < 2.5


@given(seeds)
@settings(max_examples=EXAMPLES)
def test_pairs_are_one_to_one_whatever_the_prints(seed: int) -> None:
    most = 25 if COMPILED else 12
    a, b = any_points(seed, most), any_points(seed + 1, most)
    found = aligned(a, b)
    if found is None:
        assert not local_likeness(neighbourhoods(a), neighbourhoods(b)).any()
        return
    paired = found.partner >= 0
    partners = found.partner[paired].tolist()
    assert len(set(partners)) == len(partners)
    assert ((found.partner >= -1) & (found.partner < b.shape[1])).all()
    assert (found.weight[paired] > 0).all()
    assert (found.weight <= 1 + 1e-9).all()
    assert not found.weight[~paired].any()
    assert np.isfinite(found.transform).all()
    assert np.isfinite(found.bent).all()
    assert 0.9 < math.hypot(*found.transform[:2]) < 1.1


@given(seeds)
@settings(max_examples=EXAMPLES)
def test_the_same_prints_give_the_same_alignment(seed: int) -> None:
    a, b = any_points(seed, 12), any_points(seed + 1, 12)
    first, again = aligned(a, b), aligned(a, b)
    assert (first is None) == (again is None)
    if first and again:
        for name in ("transform", "partner", "weight", "bent"):
            assert getattr(first, name).tolist() == getattr(again, name).tolist()


def test_a_true_seed_wins_over_false_ones() -> None:
    rng = np.random.default_rng(7)
    a = spread_points(rng, 20, APART)
    b = moved(a, 2.0, 40 - 80j)
    false = [(i, (i + 7) % 20) for i in range(15)]
    for place in (0, 8, 15):
        proposed = [*false[:place], (3, 3), *false[place:]]
        found = heaviest(a, b, seeds_of(*proposed))
        assert found is not None
        assert found.partner.tolist() == list(range(20))


def test_one_candidate_is_the_seed_of_most_support() -> None:
    a = spread_points(np.random.default_rng(9), 20, APART)
    b = moved(a, 1.0)
    found = heaviest(a, b, seeds_of((0, 5), (4, 4), (2, 9)), AlignmentParameters(candidates=1))
    assert found is not None
    assert found.partner.tolist() == list(range(20))


def test_candidates_are_those_of_most_support_each_transform_once() -> None:
    transforms = [[1.0, 0, 0, 0], [0, 1, 5, 5], [1, 0, 0, 0], [1, 0, 9, 9], [0, 1, 5, 5]]
    for most, expected in ((2, [1, 2]), (9, [1, 2, 3])):
        table = LightTable(1, 1, 5, AlignmentParameters(candidates=most))
        np.asarray(table.transforms)[:] = transforms
        np.asarray(table.support)[:] = [3.0, 8.0, 7.0, 2.0, 8.0]
        found = table.choose(5)
        assert np.asarray(table.chosen)[:found].tolist() == expected


@pytest.mark.parametrize("scale", [0.8, 1.25])
def test_the_scale_stays_near_one(scale: float) -> None:
    a = spread_points(np.random.default_rng(5), 25)
    found = heaviest(a, moved(a, 0.3, 9j, scale), seeds_of((0, 0)))
    assert found is not None
    assert 0.9 < math.hypot(*found.transform[:2]) < 1.1


def test_bending_follows_the_skin() -> None:
    """A shear of a few px that no similarity transform can follow is taken up by the bending."""
    rng = np.random.default_rng(21)
    a = spread_points(rng, 40, APART, size=360.0)
    b = moved(a, 0.5, 30 + 10j)
    b[0] += 7 * np.sin(b[1] / 60)
    b[1] += 7 * np.cos(b[0] / 60)
    found = aligned(a, b)
    assert found is not None
    assert (found.partner == np.arange(40)).sum() >= 36
    i = np.flatnonzero(found.partner == np.arange(40))
    after_bending = np.hypot(*(found.bent[:2, i] - b[:2, i]))
    assert after_bending.mean() < 0.6 * distances(found, a, b).mean()


def test_without_bending_minutiae_are_moved_and_no_more() -> None:
    rng = np.random.default_rng(22)
    a = spread_points(rng, 15, APART)
    b = jittered(rng, moved(a, 0.2), 2.0, 0.05)
    still = AlignmentParameters(bend_sigma_px=1e-3, bend_rounds=1)
    found = heaviest(a, b, seeds_of((0, 0)), still)
    assert found is not None
    linear = found.transform[0] + 1j * found.transform[1]
    shift = found.transform[2] + 1j * found.transform[3]
    expected = shift + linear * (a[0] + 1j * a[1])
    assert found.bent[0] + 1j * found.bent[1] == pytest.approx(expected)


def test_no_seed_no_alignment() -> None:
    a = spread_points(np.random.default_rng(1), 5)
    assert candidates(a, a, seeds_of()) == []
    assert candidates(np.empty((4, 0)), a, seeds_of()) == []


def test_two_single_minutiae_are_laid_on_one_another() -> None:
    a = spread_points(np.random.default_rng(2), 1)
    b = moved(a, 1.2, 77 + 8j)
    found = heaviest(a, b, seeds_of((0, 0)))
    assert found is not None
    assert found.partner.tolist() == [0]
    assert found.bent == pytest.approx(b)


def test_coincident_minutiae_pair_by_their_directions() -> None:
    angle = np.radians([0, 90, 180, 270])
    a = np.ascontiguousarray([np.full(4, 50.0), np.full(4, -50.0), np.cos(angle), np.sin(angle)])
    b = moved(a, math.pi / 2, 100.0 + 0j)[:, [2, 0, 3, 1]].copy()
    found = heaviest(a, b, seeds_of((0, 1)))
    assert found is not None
    assert found.partner.tolist() == [1, 3, 0, 2]
    assert math.atan2(found.transform[1], found.transform[0]) == pytest.approx(math.pi / 2)


def test_lattices_align_although_every_place_looks_alike() -> None:
    x, y = np.meshgrid(np.arange(5) * 20.0, -np.arange(5) * 20.0)
    grid = np.ascontiguousarray([x.ravel(), y.ravel(), np.ones(25), np.zeros(25)])
    found = aligned(grid, grid)
    assert found is not None
    assert found.partner.tolist() == list(range(25))
