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
  Points count as co-circular where the in-circle determinant is 0 in float64, which is exact for
  whole coordinates that span less than 4096.

Before all this, coordinates are rounded to one part in 2^20 of the extent: a whole number of
pixels stays itself, and points nearer than that coincide.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.pointset.points import UnitFrame, as_points
from fpmatch.pointset.triangulation import Triangulation

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Ints = NDArray[np.int64]
    Floats = NDArray[np.float64]
    Plane = NDArray[np.complex128]  # points or vectors as x + iy

GRID_BITS: Final = 20
"""Coordinates are triangulated to 2**-20 of the extent."""

FLATNESS: Final = 1e-9
"""Width over extent below which points count as lying on one line."""

_NO_TRIANGLES: Final = np.empty((0, 3), np.int64)
_NO_PAIRS: Final = np.empty((0, 2), np.int64)
_NEXT: Final = np.array([1, 2, 0])
_AFTER_NEXT: Final = np.array([2, 0, 1])
_SWAPPED: Final = np.array([1, 0])


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
    z = _on_unit_grid(given)
    distinct, twins = _split_coincident(z)
    if len(distinct) == 1:
        return _assemble(given, z, _NO_TRIANGLES, twins, np.arange(len(z)), _NO_PAIRS)
    along = _order_on_line(z[distinct])
    if along is not None:
        line = distinct[along]
        joined = np.column_stack([line[:-1], line[1:]])
        return _assemble(given, z, _NO_TRIANGLES, joined, line, twins)
    triangles = distinct[_qhull_triangles(z[distinct])]
    sides = _Sides.of(triangles, len(z))
    tied = _ties(z, sides)
    if len(tied):
        triangles = _fan_out(z, triangles, tied)
        sides = _Sides.of(triangles, len(z))
    return _assemble(given, z, triangles, sides.edges, _hull_order(z, sides.boundary), twins)


def _on_unit_grid(points: Floats) -> Plane:
    """Return the points as x + iy, shifted and scaled by a power of two onto a grid in [0, 1]²."""
    steps = np.rint(np.ldexp(UnitFrame.of(points).apply(points), GRID_BITS))
    return np.asarray(np.ldexp(steps, -GRID_BITS).view(np.complex128).ravel())


def _cross(u: Plane, v: Plane) -> Floats:
    """Return the cross product of the vectors, positive where v lies counter-clockwise of u."""
    return np.asarray(u.real * v.imag - u.imag * v.real)


def _square(u: Plane) -> Floats:
    return np.asarray(u.real * u.real + u.imag * u.imag)


def _split_coincident(z: Plane) -> tuple[Ints, Ints]:
    """Return the points that stand for all, and pairs (stand-in, coincident point)."""
    order = z.argsort(kind="stable")  # complex numbers sort by x, then y
    ordered = z[order]
    new = np.ones(len(z), bool)
    new[1:] = ordered[1:] != ordered[:-1]
    if new.all():
        return np.arange(len(z)), _NO_PAIRS
    stand_in = order[new][new.cumsum() - 1]
    return np.sort(order[new]), np.column_stack([stand_in[~new], order[~new]])


def _order_on_line(z: Plane) -> Ints | None:
    """Return the order of the points along their common line, or None where there is none."""
    if len(z) < 2:
        return np.arange(len(z))
    offset = z - z.min()
    length = _square(offset)
    axis = offset[length.argmax()]
    if np.abs(_cross(axis, offset)).max() > FLATNESS * length.max():
        return None
    return np.asarray((offset * axis.conjugate()).real.argsort(kind="stable"))


def _qhull_triangles(z: Plane) -> Ints:
    """Return Qhull's Delaunay triangles of distinct points, counter-clockwise."""
    from scipy.spatial import Delaunay  # noqa: PLC0415  (slow to import)

    triangles = Delaunay(z.view(np.float64).reshape(-1, 2)).simplices.astype(np.int64)
    a, b, c = z[triangles.T]
    area = _cross(b - a, c - a)
    clockwise = area < 0
    triangles[clockwise] = triangles[clockwise][:, ::-1]
    return triangles if area.all() else triangles[area != 0]


@dataclass(frozen=True, slots=True, eq=False)
class _Sides:
    """Hold the sides of triangles: side 3t + k runs from corner k of triangle t to the next one.

    `edges` are the sides as joined points (E, 2), each once, sorted; `boundary` the points on
    sides that one triangle has alone; `shared` the pairs (2, S) of sides that are one edge; and
    `start`, `end`, `opposite` the points of each side and across from it.
    """

    edges: Ints
    boundary: Ints
    shared: Ints
    start: Ints
    end: Ints
    opposite: Ints

    @classmethod
    def of(cls, triangles: Ints, n: int) -> _Sides:
        start = triangles.ravel()
        end = triangles[:, _NEXT].ravel()
        key = np.minimum(start, end) * n + np.maximum(start, end)
        order = key.argsort(kind="stable")
        key = key[order]
        again = np.zeros(len(key) + 1, bool)
        again[1:-1] = key[1:] == key[:-1]
        single = order[~again[:-1] & ~again[1:]]
        second = again.nonzero()[0]
        key = key[~again[:-1]]
        return cls(
            edges=np.column_stack([key // n, key % n]),
            boundary=start[single],
            shared=np.stack([order[second - 1], order[second]]),
            start=start,
            end=end,
            opposite=triangles[:, _AFTER_NEXT].ravel(),
        )


def _ties(z: Plane, sides: _Sides) -> Ints:
    """Return pairs (K, 2) of neighbouring triangles whose four corners lie on one circle."""
    one, other = sides.shared
    apex = z[sides.opposite[other]]
    a, b, c = z[sides.start[one]] - apex, z[sides.end[one]] - apex, z[sides.opposite[one]] - apex
    in_circle = _square(a) * _cross(b, c) + _square(b) * _cross(c, a) + _square(c) * _cross(a, b)
    tied = in_circle == 0
    return np.column_stack([one[tied], other[tied]]) // 3


def _fan_out(z: Plane, triangles: Ints, tied: Ints) -> Ints:
    """Replace each group of co-circular triangles by the fan from its smallest vertex."""
    kept = np.ones(len(triangles), bool)
    fans = []
    for group in _connected(tied):
        fan = _fan(z, np.unique(triangles[group]))
        a, b, c = z[fan.T]
        # where rounding took points for co-circular that are not, their triangles stay
        if len(fan) == len(group) and (_cross(b - a, c - a) > 0).all():
            kept[group] = False
            fans.append(fan)
    return np.vstack([triangles[kept], *fans])


def _connected(pairs: Ints) -> list[list[int]]:
    """Return the groups that the pairs hold together."""
    group_of: dict[int, list[int]] = {}
    for i, j in pairs.tolist():
        a = group_of.setdefault(i, [i])
        b = group_of.setdefault(j, [j])
        if a is not b:
            a.extend(b)
            group_of.update(dict.fromkeys(b, a))
    return list({id(group): group for group in group_of.values()}.values())


def _fan(z: Plane, vertices: Ints) -> Ints:
    """Triangulate the convex polygon of `vertices` from its smallest one (x, then y)."""
    smallest = vertices[z[vertices].argmin()]
    rest = vertices[vertices != smallest]
    rest = rest[np.angle(z[rest] - z[smallest]).argsort(kind="stable")]
    return np.column_stack([np.full(len(rest) - 1, smallest), rest[:-1], rest[1:]])


def _hull_order(z: Plane, boundary: Ints) -> Ints:
    """Return the boundary points counter-clockwise, from the smallest (x, then y)."""
    corners = z[boundary]
    order = np.angle(corners - corners.mean()).argsort(kind="stable")
    first = int((order == corners.argmin()).argmax())
    return np.asarray(boundary[np.concatenate([order[first:], order[:first]])])


def _assemble(
    given: Floats, z: Plane, triangles: Ints, joined: Ints, hull: Ints, twins: Ints
) -> Triangulation:
    """Build the result from its triangles, the edges between stand-ins, the hull and the twins."""
    n = len(given)
    edges = joined
    start, end = np.concatenate([joined, joined[:, _SWAPPED]]).T
    if len(twins):
        start, end = np.concatenate([start, twins[:, 1]]), np.concatenate([end, twins[:, 0]])
        edges = np.concatenate([joined, twins])
    if not len(triangles):
        edges = np.sort(edges, axis=1)
    order = np.lexsort((np.angle(z[end] - z[start]), start))
    ring_start = np.zeros(n + 1, np.int32)
    np.bincount(start, minlength=n).cumsum(out=ring_start[1:])
    interior = np.ones(n, bool)
    interior[hull] = False
    interior[twins[:, 1]] = False
    return Triangulation(
        points=_frozen(given),
        triangles=_frozen(triangles.astype(np.int32)),
        edges=_frozen(edges.astype(np.int32)),
        hull=_frozen(hull.astype(np.int32)),
        ring_start=_frozen(ring_start),
        ring=_frozen(end[order].astype(np.int32)),
        interior=_frozen(interior),
    )


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    array.setflags(write=False)
    return array
