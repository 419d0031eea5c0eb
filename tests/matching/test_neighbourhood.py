"""Neighbourhoods: known small ones, invariance, hostile positions, and a slow twin."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_prints import any_points, on_pixels, plane, seeds, spread_points

from fpmatch.matching import neighbourhood as described
from fpmatch.matching.neighbourhood import (
    NeighbourhoodParameters,
    Neighbourhoods,
    neighbourhoods,
)
from fpmatch.pointset.delaunay.triangulate import triangulate
from fpmatch.pointset.paper.parametrize import parametrize

P = NeighbourhoodParameters()


def minutiae(*rows):
    """Return minutiae (4, N) from rows x, y (up), direction in degrees."""
    x, y, degrees = np.array(rows, float).reshape(-1, 3).T
    return np.ascontiguousarray([x, y, np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])


def mesh_of(points):
    return triangulate(np.ascontiguousarray(points[:2].T))


def frame_from_the_definition(points, p):
    """Return the neighbours of each minutia, one at a time, from the triangulation and the rings.

    Each is a vector as a column of `Neighbourhoods.frame`, nearest first.
    """
    mesh = mesh_of(points)
    joined = [set() for _ in range(points.shape[1])]
    for i, j in mesh.edges.tolist():
        joined[i].add(j)
        joined[j].add(i)
    z, d = plane(points), points[2] + 1j * points[3]
    frames = []
    for i, ring in enumerate(joined):
        two_rings = ring.union(*(joined[j] for j in ring)) - {i}
        nearest = sorted(two_rings, key=lambda j: (math.dist(points[:2, i], points[:2, j]), j))
        nearest = nearest[: p.size]
        share = dict.fromkeys(range(points.shape[1]), p.second_ring_weight)
        if mesh.interior[i]:
            one_ring = mesh.one_ring(i).tolist()
            weights = parametrize(mesh.points[one_ring], mesh.points[i]).weights
            for j, weight in zip(one_ring, weights, strict=True):
                share[j] += (1 - p.second_ring_weight) * weight * len(one_ring)
        total = sum(share[j] for j in nearest)
        columns = []
        for j in nearest:
            seen, heading = (z[j] - z[i]) * np.conj(d[i]), d[j] * np.conj(d[i])
            precision = (p.tolerance_px + p.tolerance_per_px * abs(seen)) ** -2
            weight = math.sqrt(share[j] * len(nearest) / total)
            columns.append([seen.real, seen.imag, heading.real, heading.imag, precision, weight])
        frames.append(columns)
    return frames


def test_a_neighbour_stands_in_the_frame_of_its_minutia():
    found = neighbourhoods(minutiae((10, 10, 90), (10, 40, 180), (-10, 10, 90)))
    # From the first minutia, which looks up: 30 px ahead, and 20 px to the left.
    assert found.count.tolist() == [2, 2, 2]
    left, ahead = found.frame[0, :4, :2].T
    assert left == pytest.approx([0, 20, 1, 0], abs=1e-5)
    assert ahead == pytest.approx([30, 0, 0, 1], abs=1e-5)
    precision = [(P.tolerance_px + P.tolerance_per_px * d) ** -2 for d in (20, 30)]
    assert found.frame[0, 4, :2] == pytest.approx(precision)


@given(seeds, st.integers(1, 14), st.floats(0.1, 1))
def test_frames_agree_with_their_slow_twin(seed, size, second):
    points = any_points(seed)
    p = NeighbourhoodParameters(size=size, second_ring_weight=second)
    found = neighbourhoods(points, p)
    slow = frame_from_the_definition(points, p)
    assert found.frame.shape == (points.shape[1], 6, size)
    assert found.count.tolist() == [len(columns) for columns in slow]
    for frame, columns in zip(found.frame, slow, strict=True):
        listed = np.array(columns).reshape(-1, 6).T
        assert frame[:, : len(columns)] == pytest.approx(listed, rel=1e-4, abs=1e-4)
        assert not frame[:, len(columns) :].any()


@given(seeds, st.integers(1, 14))
def test_compiled_and_interpreted_agree(plain, seed, size):
    points = any_points(seed)
    p = NeighbourhoodParameters(size=size)
    fast = neighbourhoods(points, p)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(described, "kernel", plain.neighbourhood)
        slow = neighbourhoods(points, p)
    for name in Neighbourhoods.__slots__:
        assert getattr(fast, name).tolist() == getattr(slow, name).tolist()


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_few_minutiae_know_one_another(n):
    points = spread_points(np.random.default_rng(n), n)
    found = neighbourhoods(points)
    assert found.count.tolist() == [max(n - 1, 0)] * n
    assert found.frame.shape == (n, 6, P.size)


@given(seeds)
def test_crowded_minutiae_keep_every_value_finite(seed):
    points = on_pixels(np.random.default_rng(seed), 40, side=4)
    found = neighbourhoods(points)
    assert np.isfinite(found.frame).all()
    assert (found.frame[:, 4] <= np.float32(P.tolerance_px**-2)).all()
