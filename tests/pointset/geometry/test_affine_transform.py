import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import affine_transforms, seeds, similarities

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.affine_transform import AffineTransform

POINTS = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 2.0], [3.0, 7.0]])
every_transform = affine_transforms(8.0) | affine_transforms(8.0, mirrored=True)


@given(every_transform)
def test_the_inverse_undoes_the_map(move):
    assert move.inverse().apply(move.apply(POINTS)) == pytest.approx(POINTS, abs=1e-8)
    assert move.inverse().after(move).matrix == pytest.approx(np.eye(2, 3), abs=1e-8)
    assert move.inverse().mirrored == move.mirrored == (np.linalg.det(move.matrix[:, :2]) < 0)


@given(every_transform)
def test_the_parts_make_the_map_and_the_matrix_does(move):
    parts = (move.scale_x, move.scale_y, move.shear, move.rotation, move.tx, move.ty)
    again = AffineTransform.of_parts(*parts, mirrored=move.mirrored)
    assert again.matrix == pytest.approx(move.matrix, rel=1e-9, abs=1e-9)
    assert AffineTransform.of_matrix(move.matrix) == move
    largest, least = np.linalg.svd(move.matrix[:, :2], compute_uv=False)
    assert move.anisotropy == pytest.approx(largest / least, rel=1e-6)
    assert move.scale == pytest.approx(math.sqrt(largest * least))
    assert move.determinant == pytest.approx(np.linalg.det(move.matrix[:, :2]))
    apart = move.rotation_deg - math.degrees(move.rotation)
    assert math.remainder(apart, 360) == pytest.approx(0, abs=1e-9)  # half a turn has two signs


@given(*[every_transform | similarities(5, 9)] * 2, seeds)
def test_a_composition_applies_the_first_one_first(move, first, seed):
    points = np.random.default_rng(seed).uniform(-5, 5, (6, 2))
    expected = move.apply(first.apply(points))
    assert move.after(first).apply(points) == pytest.approx(expected, rel=1e-9, abs=1e-7)


@given(similarities(5, 9))
def test_a_similarity_keeps_its_parts(move):
    same = AffineTransform.of_matrix(move.matrix)
    assert same.is_similarity
    assert (same.mirrored, move.mirrored) == (False, False)
    assert (same.scale, same.shear) == pytest.approx((move.scale, 0.0), abs=1e-9)
    assert math.cos(same.rotation - move.rotation) == pytest.approx(1.0)


@given(every_transform, seeds)
def test_a_fit_recovers_the_map_and_minimises_residuals(move, seed):
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 10, (8, 2))
    exact = AffineTransform.fit(p, move.apply(p))
    assert exact.apply(p) == pytest.approx(move.apply(p), abs=1e-7)
    q = move.apply(p) + rng.normal(0, 0.1, p.shape)
    residual = AffineTransform.fit(p, q).apply(p) - q
    assert residual.sum(axis=0) == pytest.approx(0, abs=1e-7)
    assert residual.T @ p == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("size", [1e-200, 1.0, 1e200])
def test_any_magnitude_stays_finite(size):
    move = AffineTransform(size, 0.0, 0.0, 0.5 * size, 2 * size, 0.0)
    assert (move.scale, move.scale_x) == pytest.approx((math.sqrt(2) * size, 1.25**0.5 * size))
    assert move.scale_y * (move.scale_x / size) == pytest.approx(2 * size)
    assert move.inverse().after(move).matrix == pytest.approx(np.eye(2, 3))


@pytest.mark.parametrize(
    "values", [(0, 0, 0, 0, 0, 0), (1, 2, 0, 2, 4, 0), (math.nan,), (1, 0, math.inf)]
)
def test_what_has_no_inverse_is_refused(values):
    with pytest.raises(PointSetError, match="inverse"):
        AffineTransform(*values)


@pytest.mark.parametrize(
    ("p", "q", "words"),
    [
        (POINTS[:2], POINTS[:2], "at least three"),
        (POINTS, POINTS[:3], "4 and 3"),
        ([[0, 0], [1, 1], [2, 2]], POINTS[:3], "one line"),
        (POINTS[:3], [[0, 0], [1, 1], [2, 2]], "inverse"),
    ],
)
def test_points_that_determine_no_map_are_refused(p, q, words):
    with pytest.raises(PointSetError, match=words):
        AffineTransform.fit(p, q)


@given(st.floats(-170, 170))
def test_half_a_turn_is_180_degrees(degrees):
    assert AffineTransform(-1.0, 0.0, 0.0, -0.0, -1.0).rotation_deg == 180.0
    move = AffineTransform.of_parts(rotation=math.radians(degrees))
    assert move.rotation_deg == pytest.approx(degrees)
