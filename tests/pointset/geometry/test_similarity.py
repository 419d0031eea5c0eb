import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import seeds, similarities

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.similarity import Similarity

moves = similarities(100, 1e3)
POINTS = np.array([[0.0, 0.0], [10.0, 2.0], [-3.0, 7.0], [4.0, 4.0]])


@given(moves, seeds, st.booleans())
def test_no_small_change_of_a_fit_is_better(move, seed, with_scale):
    rng = np.random.default_rng(seed)
    target = move.apply(POINTS) + rng.normal(0, move.scale, POINTS.shape)
    weights = rng.uniform(0.1, 2, len(POINTS))

    def cost(fit):
        return float(weights @ ((fit.apply(POINTS) - target) ** 2).sum(axis=1))

    best = Similarity.fit(POINTS, target, weights, with_scale=with_scale)
    assert with_scale or best.scale == 1
    for _ in range(10):
        nudged = Similarity(
            best.scale * (1 + with_scale * rng.normal(0, 1e-3)),
            best.rotation + rng.normal(0, 1e-3),
            best.tx + rng.normal(0, 1e-2 * move.scale),
            best.ty + rng.normal(0, 1e-2 * move.scale),
        )
        assert cost(nudged) >= cost(best)


@given(moves, moves, st.booleans(), st.booleans())
def test_inverse_composition_and_matrix(first, second, flip, flip_again):
    first, second = replace(first, mirrored=flip), replace(second, mirrored=flip_again)
    there = first.apply(POINTS)
    assert first.inverse().apply(there) == pytest.approx(POINTS, abs=1e-6)
    assert second.after(first).apply(POINTS) == pytest.approx(second.apply(there), abs=1e-5)
    homogeneous = np.column_stack([POINTS, np.ones(len(POINTS))])
    assert (np.linalg.det(first.matrix[:, :2]) < 0) == flip
    assert homogeneous @ first.matrix.T == pytest.approx(there, abs=1e-9)


def test_coincident_points_give_a_shift():
    fitted = Similarity.fit([[1, 1], [1, 1]], [[3, 0], [5, 0]])
    assert (fitted.scale, fitted.rotation, fitted.tx, fitted.ty) == (1, 0, 3, -1)


@pytest.mark.parametrize(
    ("rotation", "degrees"),
    [(0.0, 0.0), (math.pi, 180.0), (-math.pi, 180.0), (1.5 * math.pi, -90.0)],
)
def test_rotation_in_degrees(rotation, degrees):
    assert Similarity(rotation=rotation).rotation_deg == pytest.approx(degrees)


@pytest.mark.parametrize(
    "bad", [{"scale": 0.0}, {"scale": -1.0}, {"tx": math.nan}, {"rotation": math.inf}]
)
def test_impossible_transform_is_refused(bad):
    with pytest.raises(PointSetError):
        Similarity(**bad)


@pytest.mark.parametrize(
    ("source", "target", "weights"),
    [
        ([], [], None),
        (POINTS, POINTS[:2], None),
        (POINTS, POINTS * np.nan, None),
        (POINTS, POINTS, [1, 1, 1]),
        (POINTS, POINTS, [1, 1, 1, -1]),
        (POINTS, POINTS, [0, 0, 0, 0]),
        ([1, 2, 3], [1, 2, 3], None),
    ],
)
def test_impossible_fit_is_refused(source, target, weights):
    with pytest.raises(PointSetError):
        Similarity.fit(source, target, weights)
