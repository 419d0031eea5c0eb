"""Points that span no triangle: few, coincident, or all on one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.pointset.delaunay.triangulation import Triangulation
from fpmatch.pointset.geometry.frames import UnitFrame

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Ints = NDArray[np.int64]
    Plane = NDArray[np.complex128]  # points as x + iy


def triangulate_collinear(points: NDArray[np.float64], grid_bits: int) -> Triangulation:
    """Join each of finite points (N, 2) on one line to the next along it.

    Points that are equal to 2**-grid_bits of the extent coincide: the first stands for the rest,
    and each of the others is joined to it alone.
    """
    n = len(points)
    steps = np.rint(np.ldexp(UnitFrame.of(points).apply(points), grid_bits))
    z = np.ldexp(steps, -grid_bits).view(np.complex128).ravel()
    distinct, repeats = _split_coincident(z)
    line = _order_on_line(z, distinct)
    path = np.column_stack([line[:-1], line[1:]])
    start, end = np.vstack([path, path[:, ::-1], repeats[:, ::-1]]).T
    if len(distinct) == 1:  # then the others are neighbours of the first as well
        start, end = np.vstack([repeats, repeats[:, ::-1]]).T
        line = np.arange(n)
    order = np.lexsort((np.angle(z[end] - z[start]), start))
    arrays = (
        np.empty((0, 3), np.int32),
        np.sort(np.vstack([path, repeats]), axis=1).astype(np.int32),
        line.astype(np.int32),
        np.bincount(start + 1, minlength=n + 1).cumsum().astype(np.int32),
        end[order].astype(np.int32),
        np.zeros(n, np.bool_),
    )
    for array in arrays:
        array.setflags(write=False)
    return Triangulation(points, *arrays)


def _split_coincident(z: Plane) -> tuple[Ints, Ints]:
    """Return the points that stand for all, by x then y, and pairs (stand-in, coincident)."""
    order = z.argsort(kind="stable")  # complex numbers sort by x, then y
    new = np.ones(len(z), bool)
    new[1:] = z[order[1:]] != z[order[:-1]]
    distinct = order[new]
    stand_in = distinct[new.cumsum() - 1]
    return distinct, np.column_stack([stand_in[~new], order[~new]])


def _order_on_line(z: Plane, points: Ints) -> Ints:
    """Return `points` in their order along the line through the first and the furthest from it."""
    if len(points) < 2:
        return points
    offset = z[points] - z[points[0]]
    axis = offset[np.abs(offset).argmax()]
    return np.asarray(points[(offset * axis.conjugate()).real.argsort(kind="stable")])
