"""The paper's Figure 5: how the weights of eq. (4) come about, a sub-triangle for every point."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import NEUTRAL_INK, TEXT
from fpmatch.drawing.paper_figures.marks import (
    CENTRE_DOT,
    LABEL_DISTANCE,
    SPOKE,
    TINTS,
    dots,
    label_size,
    line,
    polygon,
    ring_lines,
)
from fpmatch.drawing.paper_figures.sheet import Sheet, show
from fpmatch.drawing.paper_figures.table import table
from fpmatch.drawing.paper_figures.text import label
from fpmatch.drawing.paper_figures.words import name, number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.drawing.paper_figures.ring import Ring

COLUMNS: Final = 3
TRIANGLE_HEIGHT, TABLE_HEIGHT = 200, 270
ROOM: Final = 30.0  # pixels around a ring, for its names
WIDE_ROOM: Final = 54.0  # the same, for numbers
DIGITS: Final = 3


@dataclass(frozen=True, slots=True)
class SubTriangle:
    """Hold the triangle of a ring that one of its points makes with the side across the centre.

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
    """Return the sub-triangle of every point of a ring.

    Parameters
    ----------
    ring : array_like of float, shape (d, 2)
        The ring's points, counter-clockwise, once round the centre.
    centre : array_like of float, shape (2,)
        The centre.

    Returns
    -------
    list of SubTriangle
        One a point, in order. The mean share of a point over all of them is its weight λ.

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
        for place, share in zip(triangle.corners, triangle.shares, strict=True):
            mu[place, column] += share
    return mu


def weights(ring: Ring) -> Sheet:
    """Draw Figure 5: each sub-triangle with its shares, and the weights as their means."""
    triangles = sub_triangles(ring.points, ring.middle)
    mu = shares_table(triangles)
    d, letter = len(ring), ring.side.letter.lower()
    caption = (
        f"For each of the {d} points of the ring, the line from it through the centre "
        f"{letter} (hollow) leaves the ring by one of its sides. Point and side make a triangle "
        f"around {letter}; above it stands {letter} in barycentric coordinates δ, which sum to 1. "
        f"A point's weight λ is the mean of its shares over all {d} triangles (eq. 4): "
        f"from {number(mu.mean(axis=1).min(), DIGITS)} to {number(mu.mean(axis=1).max(), DIGITS)} "
        f"here, in all {number(mu.mean(axis=1).sum(), DIGITS)}. With these weights "
        f"Σ λ{letter} gives {letter} itself."
    )
    rows = math.ceil(d / COLUMNS)
    heights = [TRIANGLE_HEIGHT] * rows + [TABLE_HEIGHT]
    sheet = Sheet("Figure 5. Weights from sub-triangles", caption, COLUMNS, heights)
    for n, triangle in enumerate(triangles):
        axes = sheet.panel(n // COLUMNS, n % COLUMNS, _sum(ring, triangle))
        _sub_triangle(axes, ring, triangle)
    axes = sheet.panel(rows, 0, "the mean of all: weights λ")
    _means(axes, ring, mu.mean(axis=1))
    title = "shares of the points (rows) in the triangles (columns)"
    axes = sheet.panel(rows, 1, title, columns=COLUMNS - 1, framed=False)
    _shares(axes, ring, mu)
    return sheet


def _sum(ring: Ring, triangle: SubTriangle) -> str:
    """Write the centre as the sum of its shares."""
    letter = ring.side.letter
    terms = (
        f"{number(share, 2)} {name(letter, place)}"
        for place, share in zip(triangle.corners, triangle.shares, strict=True)
    )
    return f"{letter.lower()} = {' + '.join(terms)}"


def _sub_triangle(axes: Axes, ring: Ring, triangle: SubTriangle) -> None:
    tint, letter = TINTS[ring.side.letter], ring.side.letter
    show(axes, ring.points, ROOM)
    line(axes, np.vstack([ring.points, ring.points[:1]]), NEUTRAL_INK, SPOKE)
    corners = ring.points[list(triangle.corners)]
    polygon(axes, corners, tint)
    _, two, three = triangle.shares
    leaves = (two * corners[1] + three * corners[2]) / (two + three)
    line(axes, [corners[0], leaves], TEXT, SPOKE, dashed=True)
    dots(axes, corners, tint)
    dots(axes, ring.middle, tint, CENTRE_DOT, hollow=True)
    middle = ring.points.mean(axis=0)
    for place in sorted(set(triangle.corners)):
        at = ring.points[place]
        label(axes, at, name(letter, place), away=at - middle, distance=LABEL_DISTANCE)


def _means(axes: Axes, ring: Ring, means: NDArray[np.float64]) -> None:
    show(axes, ring.points, WIDE_ROOM)
    ring_lines(axes, ring)
    middle = ring.points.mean(axis=0)
    for k, at in enumerate(ring.points):
        text = number(means[k], DIGITS)
        size = label_size(ring)
        label(axes, at, text, away=at - middle, distance=LABEL_DISTANCE, size=size)


def _shares(axes: Axes, ring: Ring, mu: NDArray[np.float64]) -> None:
    letter = ring.side.letter
    head = ["", *(f"l = {place}" for place in range(1, len(ring) + 1)), "mean λ"]
    rows = [
        [name(letter, k), *(number(share, 2) if share else "·" for share in row), number(mean)]
        for k, (row, mean) in enumerate(zip(mu, mu.mean(axis=1), strict=True))
    ]
    sums = ["Σ", *(number(value, 2) for value in mu.sum(axis=0)), number(mu.mean(axis=1).sum())]
    table(axes, head, rows, sums)
