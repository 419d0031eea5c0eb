"""Delaunay's criterion, planarity and the tie rule by exact arithmetic, on hostile points."""

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pointset_strategies import any_finite_points, crowded_pixels, seeds

from fpmatch.pointset.delaunay._point_order_kernel import sort_points
from fpmatch.pointset.delaunay.triangulate import FLATNESS, GRID_BITS, triangulate


def lattice(rng, n, step):
    side = math.isqrt(n) + 1
    return rng.permutation(np.argwhere(np.ones((side, side)))[:n] * step)


def clusters(rng, n):
    """Return clusters a millionth, and some a billionth, as wide as the set."""
    centre = rng.random((n // 8 + 1, 2))[rng.integers(0, n // 8 + 1, n)]
    return np.asarray(centre + rng.normal(0, 1, (n, 2)) * rng.choice([1e-6, 1e-9], (n, 1)))


def nearly_on_a_line(rng, n):
    turn = np.exp(1j * rng.uniform(0, 7))
    z = (rng.random(n) + 1j * rng.random(n) * 10.0 ** rng.uniform(-10, -3)) * turn
    return np.column_stack([z.real, z.imag])


def on_a_circle(rng, n):
    """Return whole points on circles of radius 5·13·17·29 about one centre, and the centre."""
    radius = 5 * 13 * 17 * 29
    ring = [
        (x, y)
        for x in range(-radius, radius + 1)
        for y in [math.isqrt(radius * radius - x * x)]
        if x * x + y * y == radius * radius
    ]
    rings = np.array([*ring, *((x, -y) for x, y in ring), (0, 0)], float)
    return rng.permutation(rings)[:n]


def of_all_sizes(rng, n):
    return np.asarray(rng.choice([-1.0, 1.0], (n, 2)) * 10.0 ** rng.uniform(-300, 90, (n, 2)))


hostile = {
    "pixels": lambda rng, n: rng.integers(0, 12, (n, 2)).astype(float),
    "large whole numbers": lambda rng, n: rng.integers(0, 2**40, (n, 2)).astype(float),
    "lattice": lambda rng, n: lattice(rng, n, 1.0),
    "lattice not on whole numbers": lambda rng, n: lattice(rng, n, 0.1),
    "clusters": clusters,
    "nearly on a line": nearly_on_a_line,
    "on a circle": on_a_circle,
    "duplicates": lambda rng, n: rng.random((n // 3 + 1, 2))[rng.integers(0, n // 3 + 1, n)],
    "tiny": lambda rng, n: rng.uniform(-1, 1, (n, 2)) * 1e-300,
    "subnormal": lambda rng, n: rng.integers(-9, 9, (n, 2)) * 5e-324,
    "of all sizes": of_all_sizes,
}
families = st.sampled_from(sorted(hostile))


def made(family, seed, n):
    return np.asarray(hostile[family](np.random.default_rng(seed), n), float)


def cross(o, a, b):
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])


def in_circle(a, b, c, d):
    """Return a number above 0 where d is inside the circle through a, b, c (ccw)."""
    (ax, ay, al), (bx, by, bl), (cx, cy, cl) = (
        (x - d[0], y - d[1], (x - d[0]) ** 2 + (y - d[1]) ** 2) for x, y in (a, b, c)
    )
    return al * (bx * cy - by * cx) + bl * (cx * ay - cy * ax) + cl * (ax * by - ay * bx)


def check_exactly(points):
    """Assert all that makes a Delaunay triangulation, on the whole numbers it was decided on.

    Triangles that turn left, tile the hull and fulfil the criterion across every edge are one.
    """
    mesh = triangulate(points)
    in_order = sort_points(np.ascontiguousarray(points), FLATNESS)
    if in_order is None:
        assert not len(mesh.triangles)
        assert not mesh.interior.any()
        return mesh
    xy, distinct, order = in_order
    at = dict(
        zip(order[0, :distinct].tolist(), xy[:, :distinct].T.astype(int).tolist(), strict=True)
    )
    hull, corners = mesh.hull.tolist(), mesh.triangles.tolist()
    assert len(corners) == 2 * distinct - 2 - len(hull)
    assert len(mesh.edges) == 3 * distinct - 3 - len(hull) + len(points) - distinct
    assert all(cross(at[a], at[b], at[c]) > 0 for a, b, c in corners)
    area = sum(cross((0, 0), at[a], at[b]) for a, b in itertools.pairwise([*hull, hull[0]]))
    assert sum(cross(at[a], at[b], at[c]) for a, b, c in corners) == area
    opposite = {}
    for a, b, c in corners:
        opposite.update({(a, b): c, (b, c): a, (c, a): b})
    assert len(opposite) == 3 * len(corners)
    for (a, b), c in opposite.items():
        d = opposite.get((b, a))
        if d is None:
            assert {a, b} <= set(hull)
            continue
        inside = in_circle(at[a], at[b], at[c], at[d])
        assert inside <= 0
        if inside == 0:  # the smallest of the four has its diagonal
            assert min((a, b, c, d), key=at.__getitem__) in (a, b)
    outer = {(a, b) for a, b in opposite if (b, a) not in opposite}
    assert outer == set(itertools.pairwise([*hull, hull[0]]))
    check_rings(mesh, at, opposite)
    return mesh


def check_rings(mesh, at, opposite):
    """Assert that each ring is what its triangles say, counter-clockwise from direction -π on."""
    joined = {(a, b) for a, b in mesh.edges.tolist()}
    on_hull = set(mesh.hull.tolist())
    for i in range(len(mesh)):
        ring = mesh.one_ring(i).tolist()
        if i not in at:  # coincides with an earlier point
            assert ring == [j for j, k in joined if k == i]
            assert not mesh.interior[i]
            continue
        assert mesh.interior[i] == (i not in on_hull)
        corners = list(zip(ring, [*ring[1:], ring[0]], strict=True))
        assert sum(opposite.get((i, a)) == b for a, b in corners) == len(ring) - (i in on_hull)
        away = [(at[j][0] - at[i][0], at[j][1] - at[i][1]) for j in ring]
        half = [y >= 0 for _, y in away]
        assert half == sorted(half)
        for (x, y), (p, q) in itertools.pairwise(away):
            assert (y < 0 <= q) or x * q - y * p > 0 or (y == q == 0 and p < 0 < x)


@given(st.builds(made, families, seeds, st.integers(3, 70)) | crowded_pixels | any_finite_points)
@settings(max_examples=400)
def test_any_points_get_an_exact_delaunay_triangulation(points):
    check_exactly(points)


@pytest.mark.parametrize("family", sorted(hostile))
def test_many_hostile_points_get_an_exact_delaunay_triangulation(family):
    mesh = check_exactly(made(family, 7, 1500))
    if family not in ("subnormal", "of all sizes", "pixels", "on a circle"):
        assert len(mesh.hull) + len(mesh.triangles) > 500


@given(any_finite_points)
def test_whole_numbers_are_the_points_to_the_precision_promised(points):
    in_order = sort_points(points, 0.0)
    if in_order is None:
        return
    xy, distinct, order = in_order
    whole = xy[:, :distinct].T
    assert (whole == np.rint(whole)).all()
    assert [*map(tuple, whole)] == sorted({*map(tuple, whole)})
    place = order[1]
    place = np.where(place < 0, place[-1 - place], place)
    exact = [[Fraction(x) for x in row] for row in points.tolist()]
    left, low = (min(column) for column in zip(*exact, strict=True))
    extent = max(max(column) - min(column) for column in zip(*exact, strict=True))
    step = extent / Fraction(whole.max())
    for (x, y), k in zip(exact, place.tolist(), strict=True):
        assert abs((x - left) - step * int(whole[k, 0])) <= extent / 2 ** (GRID_BITS - 1)
        assert abs((y - low) - step * int(whole[k, 1])) <= extent / 2 ** (GRID_BITS - 1)


def test_whole_pixels_stay_whole_pixels():
    points = np.array([[300.0, 7.0], [12.0, 40.0], [12.0, 9.0], [300.0, 7.0], [155.0, 201.0]])
    xy, distinct, order = sort_points(points, FLATNESS)
    assert xy[:, :distinct].T.tolist() == [[0, 2], [0, 33], [143, 194], [288, 0]]
    assert order[0, :distinct].tolist() == [2, 1, 4, 0]
    assert order[1].tolist() == [3, 1, 0, -1, 2]
