import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pointset_strategies import (
    affine_transforms,
    check_sound,
    even_points,
    grid_of,
    in_columns,
    places,
    seeds,
    worn,
)

from fpmatch.errors import PointSetError
from fpmatch.lab.points.affine import _affine_kernel as kernel
from fpmatch.lab.points.affine.matcher import AffineParameters, match_affine
from fpmatch.lab.points.triangles._overlay_kernel import refine
from fpmatch.lab.points.triangles._partner_fit_kernel import fit_partners
from fpmatch.pointset.geometry.affine_transform import AffineTransform

# Interpreted, a proposal costs some hundred times as much: the search is cut where it is in vain.
BOUNDED = AffineParameters(max_proposals=50_000 if kernel.COMPILED else 500)


@given(seeds, st.integers(8, 40), affine_transforms(20.0))
def test_an_exact_copy_under_any_affine_map_is_found(seed, n, move):
    p = even_points(seed, n)
    order = np.random.default_rng(seed).permutation(n)
    q = move.apply(p)[order]
    match = match_affine(p, q)
    check_sound(match, p, q)
    assert isinstance(match.transform, AffineTransform)
    assert match.transform.apply(p) == pytest.approx(move.apply(p), abs=1e-6 * np.ptp(q))
    assert match.transform.inverse().apply(q) == pytest.approx(p[order], abs=1e-6)
    assert (order[match.pairs[:, 1]] == match.pairs[:, 0]).all()
    assert len(match.pairs) == n


@given(seeds, affine_transforms(3.0))
def test_a_worn_copy_is_recognised(seed, move):
    p = even_points(seed, 40)
    q, place = worn(p, move, seed, jitter=0.05)
    match = match_affine(p, q)
    check_sound(match, p, q)
    off = np.hypot(*(match.transform.apply(p) - move.apply(p)).T).max()
    assert off < 0.1 * move.scale * math.sqrt(move.anisotropy)
    assert sum(place[i] == j for i, j in match.pairs.tolist()) >= 28  # of 32


@given(seeds, affine_transforms(3.0))
def test_sets_of_different_size_match_alike_both_ways(seed, move):
    p = even_points(seed, 30)
    q = worn(p, move, seed, share=0.0)[0]
    forth, back = match_affine(p[:24], q), match_affine(q, p[:24])
    check_sound(forth, p[:24], q)
    check_sound(back, q, p[:24])
    assert forth.pairs.tolist() == sorted(back.pairs[:, ::-1].tolist())
    assert back.transform.inverse().matrix == pytest.approx(forth.transform.matrix, rel=1e-6)


@given(seeds, st.integers(5, 30), st.integers(5, 30))
def test_independent_sets_do_not_match(seed, of_p, of_q):
    p, q = even_points(seed, of_p), even_points(seed + 1, of_q)
    match = match_affine(p, q, parameters=BOUNDED)
    check_sound(match, p, q)
    assert match.transform is None or match.chance < 1e-3 / 2  # one in a thousand may


@pytest.mark.parametrize("size", [1e-60, 1e60])
def test_sets_of_any_magnitude_match(size):
    p = even_points(5, 20)
    q = AffineTransform.of_parts(2.0, 0.7, 0.4, 1.0, 30.0, -8.0).apply(p) * size
    match = match_affine(p / size, q)
    assert match.matched_share == 1
    assert match.transform.apply(p / size) == pytest.approx(q, rel=1e-6)


def test_coincident_points_are_paired_in_their_order():
    p = np.vstack([even_points(6, 20), even_points(6, 2)])
    q = p @ np.array([[1.0, 0.5], [0.0, 2.0]])
    assert match_affine(p, q).pairs.tolist() == [[i, i] for i in range(22)]


@pytest.mark.parametrize("offset", [0.0, 1e-9])
def test_points_on_a_line_or_next_to_one_are_refused(offset):
    line = np.column_stack([np.arange(9.0), 2 * np.arange(9.0)])
    line[4, 0] += offset
    with pytest.raises(PointSetError, match=r"^q: .*one line$"):
        match_affine(even_points(1, 9), line)


def test_a_large_set_is_matched_in_a_moment():
    p = even_points(9, 1000 if kernel.COMPILED else 60)
    q, _ = worn(p, AffineTransform.of_parts(3.0, 1.0, 0.5, 2.0), 1, jitter=0.1)
    match = match_affine(p, q)
    assert match.matched_share > 0.7


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
