"""The paper's Figure 5: the weights of eq. (4), from a sub-triangle for every point of a ring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import NEUTRAL_INK, TEXT
from fpmatch.drawing.paper_figures.marks import (
    CENTRE_DOT,
    LABEL_SIZE,
    SPOKE,
    TINTS,
    dots,
    label,
    line,
    polygon,
    table,
)
from fpmatch.drawing.paper_figures.ring_marks import LABEL_DISTANCE, label_size, plane_ring
from fpmatch.drawing.paper_figures.sheet import Sheet, show
from fpmatch.drawing.words import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.drawing.paper_figures.rings import Ring

COLUMNS: Final = 3
TRIANGLE_HEIGHT, TABLE_HEIGHT = 192, 262
ROOM, WIDE_ROOM = 30.0, 54.0  # pixels around a ring, for names and for numbers


@dataclass(frozen=True, slots=True)
class SubTriangle:
    """Hold the triangle that one point of a ring forms with the side across the centre.

    Parameters
    ----------
    corners : tuple of three ints
        Places in the ring of p_l, p_r and p_{r+1}: the line from p_l through the centre leaves the
        ring between the latter two.
    shares : tuple of three floats
        δ1, δ2, δ3: barycentric coordinates of the centre; not negative, their sum is 1.
    """

    corners: tuple[int, int, int]
    shares: tuple[float, float, float]


def sub_triangles(ring: ArrayLike, centre: ArrayLike) -> list[SubTriangle]:
    """Return the sub-triangle of every point of a ring, in order.

    The ring (d, 2) is counter-clockwise around the centre (2,). The mean share of a point over all
    triangles is its weight λ.

    Examples
    --------
    >>> [t.corners for t in sub_triangles([[0, 0], [4, 0], [0, 4]], [1, 1])]
    [(0, 1, 2), (1, 2, 0), (2, 0, 1)]
    """
    away = np.asarray(ring, dtype=np.float64) - np.asarray(centre, dtype=np.float64)
    d = len(away)
    cross = np.outer(away[:, 0], away[:, 1])
    cross = cross - cross.T  # twice the area of centre, point, point
    found = []
    for first in range(d):
        r = next(r for r in range(d) if cross[first, r] >= 0 > cross[first, (r + 1) % d])
        s = (r + 1) % d
        areas = np.array([cross[r, s], cross[s, first], cross[first, r]])
        one, two, three = (areas / areas.sum()).tolist()
        found.append(SubTriangle((first, r, s), (one, two, three)))
    return found


def shares_table(triangles: Sequence[SubTriangle]) -> NDArray[np.float64]:
    """Return μ_{k,l}, the share of point k (row) in the sub-triangle of point l, shape (d, d).

    Examples
    --------
    >>> shares_table(sub_triangles([[0, 0], [4, 0], [0, 4]], [1, 1])).mean(axis=1).tolist()
    [0.5, 0.25, 0.25]
    """
    mu = np.zeros((len(triangles), len(triangles)))
    for column, triangle in enumerate(triangles):
        mu[list(triangle.corners), column] += triangle.shares
    return mu


def weights(ring: Ring) -> Sheet:
    """Draw Figure 5: each sub-triangle with its shares, and the weights as their means."""
    triangles = sub_triangles(ring.points, ring.middle)
    mu = shares_table(triangles)
    mean = mu.mean(axis=1)
    d, letter = len(ring), ring.side.letter.lower()
    caption = (
        f"For each of the {d} points of the ring, the line from it through the centre "
        f"{letter} (hollow) leaves the ring by one of its sides. Point and side form a triangle "
        f"around {letter}; above it are the barycentric coordinates δ of {letter}, which sum to 1. "
        f"A point's weight λ is the mean of its shares over all {d} triangles (eq. 4): "
        f"from {number(mean.min())} to {number(mean.max())} here, in all {number(mean.sum())}. "
        f"With these weights Σ λ{letter} equals {letter}."
    )
    keys = [f"triangle {n}" for n in range(d)]
    padded = keys + ["."] * (-d % COLUMNS)
    mosaic = [padded[n : n + COLUMNS] for n in range(0, d, COLUMNS)]
    heights = [TRIANGLE_HEIGHT] * len(mosaic) + [TABLE_HEIGHT]
    mosaic.append(["means", *["shares"] * (COLUMNS - 1)])
    sheet = Sheet("Figure 5. Weights from sub-triangles", caption, mosaic, heights)
    for key, triangle in zip(keys, triangles, strict=True):
        terms = (
            f"{number(share, 2)} {ring.names[place]}"
            for place, share in zip(triangle.corners, triangle.shares, strict=True)
        )
        _sub_triangle(sheet.panel(key, f"{letter} = {' + '.join(terms)}"), ring, triangle)
    axes = sheet.panel("means", "the mean of all: weights λ")
    show(axes, ring.points, WIDE_ROOM)
    plane_ring(axes, ring)
    for at, weight in zip(ring.points, mean, strict=True):
        _outside(axes, ring, at, number(weight), label_size(ring))
    rows = [
        [name, *(number(share, 2) if share else "·" for share in row), number(weight)]
        for name, row, weight in zip(ring.names, mu, mean, strict=True)
    ]
    head = ["", *(f"l = {place}" for place in range(1, d + 1)), "mean λ"]
    sums = ["Σ", *(number(value, 2) for value in mu.sum(axis=0)), number(mean.sum())]
    axes = sheet.panel("shares", "shares of the points (rows) in the triangles (columns)")
    table(axes, [head, *rows, sums])
    return sheet


def _outside(axes: Axes, ring: Ring, at: NDArray[np.float64], text: str, size: float) -> None:
    away = at - ring.points.mean(axis=0)
    label(axes, at, text, away=away, distance=LABEL_DISTANCE, size=size)


def _sub_triangle(axes: Axes, ring: Ring, triangle: SubTriangle) -> None:
    tint = TINTS[ring.side.letter]
    show(axes, ring.points, ROOM)
    line(axes, np.vstack([ring.points, ring.points[:1]]), NEUTRAL_INK, SPOKE)
    corners = ring.points[list(triangle.corners)]
    polygon(axes, corners, tint)
    _, two, three = triangle.shares
    leaves = (two * corners[1] + three * corners[2]) / (two + three)
    line(axes, [corners[0], leaves], TEXT, SPOKE, dashed=True)
    dots(axes, corners, tint)
    dots(axes, ring.middle, tint, CENTRE_DOT, hollow=True)
    for place in sorted(set(triangle.corners)):
        _outside(axes, ring, ring.points[place], ring.names[place], LABEL_SIZE)
