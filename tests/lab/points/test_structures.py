"""Sets with rows, periods and crowds: copies get the true map, independent sets none."""

import math

import numpy as np
import pytest

from fpmatch.lab.points.match import match_points
from fpmatch.lab.points.triangles import _overlay_kernel
from fpmatch.pointset.geometry.similarity import Similarity
from research.arrangements import COPIED, INDEPENDENT, copied_pair, independent_sets

COPIES, PAIRS = 4, 2

pytestmark = pytest.mark.skipif(
    not _overlay_kernel.COMPILED, reason="interpreted, searches of millions of steps take minutes"
)


@pytest.mark.parametrize("kind", COPIED)
def test_a_copy_gets_the_true_map_and_all_pairs(kind):
    for seed in range(COPIES):
        p, q, truth = copied_pair(kind, seed)
        match = match_points(p, q)
        assert len(match.pairs) == len(np.unique(p, axis=0))
        assert match.transform.apply(p) == pytest.approx(truth.apply(p), abs=1e-6)
        assert match.chance < 1e-3
        assert match.equal_maps == 1


@pytest.mark.parametrize("kind", COPIED)
def test_a_jittered_copy_gets_the_true_map_or_none(kind):
    for seed in range(COPIES):
        p, q, truth = copied_pair(kind, seed, jitter=0.1)
        match = match_points(p, q)
        if match.transform is not None:
            assert np.hypot(*(match.transform.apply(p) - truth.apply(p)).T).max() < 3


@pytest.mark.parametrize("kind", INDEPENDENT)
def test_sets_that_share_a_structure_alone_do_not_match(kind):
    for seed in range(PAIRS):
        p, q = independent_sets(kind, seed)
        match = match_points(p, q)
        assert match.transform is None
        assert match.reason


@pytest.mark.slow
def test_large_sets_of_uneven_density_do_not_match():
    rng = np.random.default_rng(0)
    p, q = rng.normal(0, 5, (2, 5_000, 2))
    assert match_points(p, q).transform is None


@pytest.mark.parametrize(("side", "maps"), [(5, 4), (8, 4)])
def test_a_grid_is_said_to_fit_in_four_ways(side, maps):
    p = np.argwhere(np.ones((side, side))) * 15.0
    match = match_points(p, Similarity(1.5, 0.4, 3.0, 4.0).apply(p))
    assert match.equal_maps == maps
    assert f"{maps} maps fit equally well" in match.reason


@pytest.mark.parametrize("number", [7, 12, 24])
def test_a_circle_is_said_to_fit_in_as_many_ways_as_it_has_points(number):
    angle = 2 * math.pi * np.arange(number) / number
    p = 100 * np.column_stack([np.cos(angle), np.sin(angle)])
    match = match_points(p, Similarity(1.5, 0.4, 3.0, 4.0).apply(p))
    assert match.equal_maps == number
    assert f"{number} maps fit equally well" in match.reason
