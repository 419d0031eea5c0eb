"""Terms: each edge in its cell, the curvature across it, and what a probe looks up."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import any_points, spread_points, striped_field, template_of
from scipy.ndimage import map_coordinates

from fpmatch.gallery.index import terms as module
from fpmatch.gallery.index.terms import (
    TERMS,
    UNKNOWN,
    curvatures,
    edges_of,
    index_model,
    print_terms,
    probe_terms,
)
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.templates.minutiae import RidgeField


def sector(angle, count):
    return min(int(angle / math.tau % 1.0 * count), count - 1)


def term_of(a, b, curvature):
    """Return term and pose of the edge from one minutia to another."""
    along = math.atan2(b[1] - a[1], b[0] - a[0])
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    cell = min(int(math.log1p(0.012 * length) / 0.03 / 2.5), 13)
    for end in (a, b):
        cell = cell * 24 + sector(math.atan2(end[3], end[2]) - along, 24)
    borders = (-35, -15, 0, 15, 35)
    cell = cell * 7 + sum(curvature > math.radians(border) for border in borders)
    pose = sector(along + math.pi / 64, 64)
    for k in (0, 1):
        pose = pose * 32 + math.floor((a[k] + b[k]) / 16) % 32
    return cell + (curvature >= UNKNOWN), pose


@given(st.integers(0, 2**32 - 1))
def test_a_term_is_the_cell_of_an_edge(seed):
    print_ = MATCHER.prepare(template_of(any_points(seed)))
    edges = edges_of(print_)
    border = np.radians([-35, -15, 0, 15, 35])
    rng = np.random.default_rng(seed)
    curvature = rng.choice([*border, *border + 1e-9, -1.5, 1.5, UNKNOWN], len(edges))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "curvatures", lambda *_: curvature)
        term, pose = print_terms(print_)
    points = print_.points.T
    expected = [
        term_of(points[i], points[j], c)
        for (i, j), c in zip(edges.tolist(), curvature, strict=True)
    ]
    assert [*zip(term.tolist(), pose.tolist(), strict=True)] == expected
    assert not len(edges) or term.max() < TERMS


def whorl(centre_px, side=25, step=16.0):
    """Return a field of circles around a place, right and down from the corner."""
    row, column = (np.mgrid[:side, :side] + 0.5) * step
    orientation = np.arctan2(row - centre_px[1], column - centre_px[0])
    orientation = np.mod(np.pi / 2 - orientation, np.pi).astype(np.float32)
    return RidgeField(step, orientation, np.ones((side, side), bool), None)


@pytest.mark.parametrize("distance", [60.0, 100.0, 140.0])
def test_the_curvature_is_the_difference_of_the_orientations_on_both_sides(distance):
    centre, middle = np.array([200.0, 200.0]), np.array([200.0 + distance, 200.0])
    ends = middle[:, None] + [[0.0, 20.0], [0.0, 0.0]]  # along the radius: circles cross it
    points = np.vstack([ends * [[1], [-1]], [[1, 1], [0, 0]]])
    print_ = MATCHER.prepare(template_of(points, field=whorl(centre)))
    seen, back = curvatures(print_, np.array([[0, 1], [1, 0]], np.int32))
    expected = 2 * np.arctan2(28.0, distance + 10)
    assert seen == pytest.approx(expected, abs=0.03)
    assert back == -seen
    points[:2] = [[200 + distance] * 2, [-190, -210]]  # circles run along it
    along = MATCHER.prepare(template_of(points, field=whorl(centre)))
    assert curvatures(along, np.array([[0, 1]], np.int32)) == pytest.approx(0, abs=0.03)


def test_where_the_orientation_is_not_known_the_curvature_is_not():
    points = spread_points(np.random.default_rng(3), 12)
    without = MATCHER.prepare(template_of(points))
    edges = edges_of(without)
    assert (curvatures(without, edges) == UNKNOWN).all()
    small = MATCHER.prepare(template_of(points, field=striped_field(side=6)))  # of 96 px
    found = curvatures(small, edges)
    assert 0 < (found == UNKNOWN).sum() < len(edges)
    assert found[found != UNKNOWN] == pytest.approx(0, abs=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_orientation_is_interpolated_linearly_between_cells(seed):
    rng = np.random.default_rng(seed)
    code = rng.integers(0, 256, rng.integers(1, 12, 2)).astype(np.uint8)
    row, column = rng.uniform(-3, 14, (2, 2, 30))
    flow = np.exp(2j * np.pi / 255 * (code - 1.0)) * (code > 0)
    expected = map_coordinates(flow, [row, column], order=1, mode="grid-constant")
    cosine, sine = module._flow_at(code, column, row)
    assert cosine + 1j * sine == pytest.approx(expected, abs=1e-9)


def test_the_lookups_are_those_of_the_greatest_gain_within_the_budget():
    probe = MATCHER.prepare(template_of(spread_points(np.random.default_rng(3), 30)))
    few, many = probe_terms(probe, 0.1), probe_terms(probe, 5.0)
    assert 0 < len(few.term) < len(many.term)
    assert set(few.term.tolist()) <= set(many.term.tolist())
    assert (np.diff(many.term) >= 0).all()
    model = index_model()
    assert model.share[few.term].sum() * model.edges <= 2 * 0.1 * len(probe)  # without ridges
    assert set(print_terms(probe)[0].tolist()) <= set(many.term.tolist())
