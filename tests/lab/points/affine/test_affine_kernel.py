"""The affine kernel against numpy: its fits, its refinement, and which triangles it compares."""

import numpy as np
import pytest
from hypothesis import given
from pointset_strategies import affine_transforms, grid_of, in_columns, places, seeds

from fpmatch.lab.points.affine import _affine_kernel as kernel
from fpmatch.lab.points.triangles._overlay_kernel import refine
from fpmatch.lab.points.triangles._partner_fit_kernel import fit_partners
from fpmatch.pointset.geometry.affine_transform import AffineTransform


def as_move(transform):
    return transform.matrix.reshape(6)


@given(seeds, affine_transforms(5.0))
def test_a_fit_to_partners_is_that_of_least_squares(seed, move):
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 1, (12, 2))
    q = in_columns(move.apply(p) + rng.normal(0, 0.05, p.shape))
    grid = grid_of(q, 1.0)
    partner = np.array(np.argsort(grid.order), np.int32)
    partner[rng.permutation(12)[:4]] = -1
    fitted = np.empty(6)
    assert fit_partners(in_columns(p), grid, partner, fitted)
    paired = partner >= 0
    expected = AffineTransform.fit(p[paired], places(grid).T[partner[paired]])
    assert fitted == pytest.approx(as_move(expected), rel=1e-8, abs=1e-8)


@pytest.mark.parametrize("pairs", [2, 12])
def test_too_few_points_or_points_on_a_line_have_no_fit(pairs):
    along = np.linspace(0, 1, 12)
    p, move = np.stack([along, 2 * along]), np.zeros(6)
    partner = np.where(np.arange(12) < pairs, np.arange(12), -1).astype(np.int32)
    assert not fit_partners(p, grid_of(p, 0.5), partner, move)
    assert not move.any()


@given(seeds, affine_transforms(4.0))
def test_refinement_reaches_the_map_from_near_it(seed, move):
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 1, (30, 2))
    q = in_columns(move.apply(p))
    reach = 0.2 * move.scale / np.sqrt(30)
    grid = grid_of(q, reach, 2 * reach)
    near = as_move(move) + np.tile([0.0, 0.0, 0.3 * reach], 2)
    owner, partner = np.full(30, -1, np.int32), np.full(30, -1, np.int32)
    arrays = owner, partner, np.empty(30), np.zeros(1, np.int64), near
    inside = refine(in_columns(p), grid, reach**2, 12, *arrays)
    assert inside == 30
    found = partner >= 0
    assert (owner[partner[found]] == np.flatnonzero(found)).all()
    # unless two points are as close as the offset
    if (np.asarray(grid.order)[partner] == np.arange(30)).all():
        assert near == pytest.approx(as_move(move), abs=1e-8)


def test_a_fit_of_triangles_makes_its_move():
    move = AffineTransform.of_parts(2.0, 0.5, 0.3, 1.0, 4.0, -5.0)
    p = np.random.default_rng(1).uniform(0, 1, (6, 2))
    q = move.apply(p)
    a, b = p - p.mean(axis=0), q - q.mean(axis=0)
    spread, both = a.T @ a, b.T @ a
    fit = np.array([6, *p.mean(axis=0), *q.mean(axis=0), *spread[[0, 0, 1], [0, 1, 1]], *both.flat])
    made = np.empty(6)
    kernel.move_of(fit, made)
    assert made == pytest.approx(as_move(move))
