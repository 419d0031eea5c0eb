"""Delaunay triangulation of any finite point set, with the one-ring of every point.

The paper (section 3.1) takes its neighbourhoods from the triangulation. Minutiae sit on whole
pixels, so coincident, collinear and co-circular points are the normal case here, and each has its
rule:

- *coincident points*: the first stands for the rest; each of the others is joined to it by an
  edge and has it for its only neighbour, and takes no part in the triangulation (where all the
  points coincide, they are the first one's neighbours too);
- *all points on one line* (flatter than 1e-9 of their extent): edges join consecutive points,
  there are no triangles;
- *co-circular points*: the convex polygon that they span is fanned out from its smallest vertex
  (smallest x, then smallest y), so the triangulation does not depend on the order of the points.
  Points count as co-circular where the in-circle determinant is exactly 0 in float64, which is
  exact for whole coordinates that span less than 4096.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import PointSetError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]

FLATNESS: Final = 1e-9
"""Width over extent below which points count as lying on one line."""

_NO_TRIANGLES: Final = np.empty((0, 3), np.int64)
_NO_PAIRS: Final = np.empty((0, 2), np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """Hold a Delaunay triangulation of N points and its one-rings.

    Counter-clockwise means the mathematical sense in the coordinates as they stand: from +x
    towards +y (with y pointing down, that is clockwise on screen).

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        The points.
    triangles : ndarray of int32, shape (T, 3)
        Corners of each triangle, counter-clockwise.
    edges : ndarray of int32, shape (E, 2)
        Joined points, the smaller index first, sorted.
    hull : ndarray of int32, shape (H,)
        Points on the outer boundary, counter-clockwise from the smallest (x, then y); all of them
        in order along the line where the points are collinear or coincide.
    ring_start : ndarray of int32, shape (N + 1,)
        The one-ring of point i is ``ring[ring_start[i]:ring_start[i + 1]]``.
    ring : ndarray of int32
        Neighbours of each point in turn, counter-clockwise by direction, from -π on.
    interior : ndarray of bool, shape (N,)
        Whether the one-ring is a closed polygon around the point.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int32]
    edges: NDArray[np.int32]
    hull: NDArray[np.int32]
    ring_start: NDArray[np.int32]
    ring: NDArray[np.int32]
    interior: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.points)

    def one_ring(self, i: int) -> NDArray[np.int32]:
        """Return the neighbours of point `i`, counter-clockwise."""
        return self.ring[self.ring_start[i] : self.ring_start[i + 1]]


def triangulate(points: ArrayLike) -> Triangulation:
    """Triangulate `points` by Delaunay's criterion, whatever their position.

    Parameters
    ----------
    points : array_like of float, shape (N, 2)
        Any finite points; N may be 0.

    Returns
    -------
    Triangulation
        No circle through the corners of a triangle holds another point inside. The tie rules are
        those of this module's docstring.

    Raises
    ------
    PointSetError
        If the shape is not (N, 2) or a coordinate is not finite.

    Examples
    --------
    >>> mesh = triangulate([[0, 0], [4, 0], [4, 4], [0, 4], [2, 1]])
    >>> mesh.one_ring(4).tolist(), mesh.interior.tolist()
    ([0, 1, 2, 3], [False, False, False, False, True])
    """
    given = as_points(points)
    unit = _to_unit_extent(given)
    distinct, twins = _split_coincident(unit)
    if len(distinct) == 1:
        return _assemble(given, unit, _NO_TRIANGLES, twins, np.arange(len(given)), _NO_PAIRS)
    along = _order_on_line(unit[distinct])
    if along is not None:
        line = distinct[along]
        joined = np.column_stack([line[:-1], line[1:]])
        return _assemble(given, unit, _NO_TRIANGLES, joined, line, twins)
    corners, near_twins = _qhull_triangles(unit[distinct])
    corners = _fan_out_ties(unit[distinct], corners)
    triangles = distinct[corners]
    twins = np.vstack([twins, distinct[near_twins]])
    joined, boundary = _edges_of(triangles, len(given))
    return _assemble(given, unit, triangles, joined, _hull_order(unit, boundary), twins)


def as_points(points: ArrayLike, name: str = "points") -> Floats:
    """Return `points` as float64 of shape (N, 2), or refuse them.

    Parameters
    ----------
    points : array_like of float, shape (N, 2)
        The points; an empty array of any shape stands for no points.
    name : str
        What to call them in an error.

    Returns
    -------
    ndarray of float64, shape (N, 2)
        The points; a copy.

    Raises
    ------
    PointSetError
        If the values are not numbers, not finite, or not of that shape.

    Examples
    --------
    >>> as_points([[1, 2]]).dtype
    dtype('float64')
    """
    try:
        array = np.array(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise PointSetError(f"{name}: expected an array of numbers of shape (N, 2)") from error
    if array.size == 0:
        return array.reshape(0, 2)
    if array.ndim != 2 or array.shape[1] != 2:
        raise PointSetError(f"{name}: expected an array of shape (N, 2), not {array.shape}")
    if not np.isfinite(array).all():
        raise PointSetError(f"{name}: coordinates must be finite")
    return array


def _to_unit_extent(points: Floats) -> Floats:
    """Shift and scale points into [0, 1]² by a power of two, exactly for whole pixels."""
    if not len(points):
        return points
    tamed = np.ldexp(points, -_exponent(points))
    shifted = tamed - tamed.min(axis=0)
    return np.asarray(np.ldexp(shifted, -_exponent(shifted)))


def _exponent(values: Floats) -> int:
    return int(np.frexp(np.abs(values).max())[1])


def _split_coincident(points: Floats) -> tuple[Ints, Ints]:
    """Return the points that stand for all, and pairs (stand-in, coincident point)."""
    order = np.lexsort((points[:, 1], points[:, 0]))
    new = np.ones(len(points), bool)
    new[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    if new.all():
        return np.arange(len(points)), _NO_PAIRS
    stand_in = order[new][np.cumsum(new) - 1]
    return np.sort(order[new]), np.column_stack([stand_in[~new], order[~new]])


def _order_on_line(points: Floats) -> Ints | None:
    """Return the order of the points along their common line, or None where there is none."""
    if len(points) < 2:
        return np.arange(len(points))
    first = points[np.lexsort((points[:, 1], points[:, 0]))[0]]
    offset = points - first
    squared = (offset * offset).sum(axis=1)
    axis = offset[squared.argmax()]
    width = np.abs(offset[:, 0] * axis[1] - offset[:, 1] * axis[0]).max()
    if width > FLATNESS * squared.max():
        return None
    return np.lexsort((points[:, 1], points[:, 0], offset @ axis))


def _qhull_triangles(points: Floats) -> tuple[Ints, Ints]:
    """Return counter-clockwise triangles, and pairs (stand-in, point too near to it for Qhull)."""
    from scipy.spatial import Delaunay  # noqa: PLC0415  (slow to import)

    qhull = Delaunay(points)
    corners = qhull.simplices.astype(np.int64)
    area = _twice_area(points, corners)
    corners[area < 0] = corners[area < 0][:, [0, 2, 1]]
    return corners[area != 0], qhull.coplanar[:, [2, 0]].astype(np.int64)


def _twice_area(points: Floats, triangles: Ints) -> Floats:
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    u, v = b - a, c - a
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _half_edges(triangles: Ints) -> tuple[Ints, Ints, Ints]:
    """Return start, end and opposite corner of every side of every triangle."""
    following = triangles[:, [1, 2, 0]]
    opposite = triangles[:, [2, 0, 1]]
    return triangles.ravel(), following.ravel(), opposite.ravel()


def _fan_out_ties(points: Floats, triangles: Ints) -> Ints:
    """Replace each group of co-circular triangles by the fan from its smallest vertex."""
    start, end, opposite = _half_edges(triangles)
    key = np.minimum(start, end) * len(points) + np.maximum(start, end)
    order = key.argsort(kind="stable")
    shared = (key[order[1:]] == key[order[:-1]]).nonzero()[0]
    one, other = order[shared], order[shared + 1]
    apex = points[opposite[other]]
    tied = _in_circle(points[start[one]], points[end[one]], points[opposite[one]], apex) == 0
    if not tied.any():
        return triangles
    pieces = []
    grouped = np.zeros(len(triangles), bool)
    for group in _connected(one[tied] // 3, other[tied] // 3):
        fan = _fan(points, np.unique(triangles[group]))
        if len(fan) == len(group) and (_twice_area(points, fan) > 0).all():
            grouped[group] = True
            pieces.append(fan)
    return np.vstack([triangles[~grouped], *pieces])


def _in_circle(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Return the in-circle determinant: 0 where d lies on the circle through a, b and c."""
    a, b, c = a - d, b - d, c - d
    lift_a, lift_b, lift_c = ((v * v).sum(axis=1) for v in (a, b, c))
    return np.asarray(
        lift_a * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
        + lift_b * (c[:, 0] * a[:, 1] - c[:, 1] * a[:, 0])
        + lift_c * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    )


def _connected(one: Ints, other: Ints) -> list[list[int]]:
    """Return the groups of triangles that the ties (one[k], other[k]) hold together."""
    group_of: dict[int, list[int]] = {}
    for i, j in zip(one.tolist(), other.tolist(), strict=True):
        a = group_of.setdefault(i, [i])
        b = group_of.setdefault(j, [j])
        if a is not b:
            a.extend(b)
            group_of.update(dict.fromkeys(b, a))
    return list({id(group): group for group in group_of.values()}.values())


def _fan(points: Floats, vertices: Ints) -> Ints:
    """Triangulate the convex polygon of `vertices` from its smallest one (x, then y)."""
    smallest = vertices[np.lexsort((points[vertices, 1], points[vertices, 0]))[0]]
    rest = vertices[vertices != smallest]
    away = points[rest] - points[smallest]
    rest = rest[np.arctan2(away[:, 1], away[:, 0]).argsort(kind="stable")]
    return np.column_stack([np.full(len(rest) - 1, smallest), rest[:-1], rest[1:]])


def _edges_of(triangles: Ints, n: int) -> tuple[Ints, Ints]:
    """Return the sides of the triangles, each once, and the points on the outer boundary."""
    start, end, _ = _half_edges(triangles)
    key, count = np.unique(np.minimum(start, end) * n + np.maximum(start, end), return_counts=True)
    edges = np.column_stack([key // n, key % n])
    return edges, np.unique(edges[count == 1])


def _hull_order(points: Floats, boundary: Ints) -> Ints:
    """Return the boundary points counter-clockwise, from the smallest (x, then y)."""
    corners = points[boundary]
    away = corners - corners.mean(axis=0)
    order = np.arctan2(away[:, 1], away[:, 0]).argsort(kind="stable")
    first = np.lexsort((corners[:, 1], corners[:, 0]))[0]
    return np.roll(boundary[order], -int((order == first).argmax()))


def _assemble(
    given: Floats, unit: Floats, triangles: Ints, joined: Ints, hull: Ints, twins: Ints
) -> Triangulation:
    """Build the result from its triangles, the edges between stand-ins, the hull and the twins."""
    n = len(given)
    ends = np.vstack([joined, joined[:, ::-1], twins[:, ::-1]])
    away = unit[ends[:, 1]] - unit[ends[:, 0]]
    order = np.lexsort((np.arctan2(away[:, 1], away[:, 0]), ends[:, 0]))
    ring_start = np.zeros(n + 1, np.int64)
    np.cumsum(np.bincount(ends[:, 0], minlength=n), out=ring_start[1:])
    edges = np.vstack([joined, twins])
    edges = np.sort(edges, axis=1)
    interior = np.ones(n, bool)
    interior[hull] = False
    interior[twins[:, 1]] = False
    return Triangulation(
        points=_frozen(given),
        triangles=_frozen(triangles.astype(np.int32)),
        edges=_frozen(edges[np.lexsort((edges[:, 1], edges[:, 0]))].astype(np.int32)),
        hull=_frozen(hull.astype(np.int32)),
        ring_start=_frozen(ring_start.astype(np.int32)),
        ring=_frozen(ends[order, 1].astype(np.int32)),
        interior=_frozen(interior),
    )


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    array.setflags(write=False)
    return array
