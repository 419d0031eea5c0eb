"""Prints with their minutiae, triangulations and pairs: the paper's Figures 1, 3 and 8 (a)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.case_study.case import called, mark_of, names, paired_points, show_print
from fpmatch.drawing.palette import NO_MATCH, hexadecimal
from fpmatch.drawing.paper_figures.marks import (
    EDGE,
    MESHES,
    OUTLINE,
    TINTS,
    dots,
    segments,
)
from fpmatch.drawing.paper_figures.sheet import Sheet
from fpmatch.drawing.paper_figures.text import label
from fpmatch.pointset.delaunay.triangulate import triangulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.drawing.case_study.case import Case, CaseSide
    from fpmatch.matching.result import Verification

    Floats = NDArray[np.float64]

PANEL_HEIGHT: Final = 440
FULL: Final = 0.75  # share of a print's contrast where it is what is shown
TICK_PX: Final = 13.0  # length of a direction's tick on the page
DOT, SMALL_DOT = 7.0, 5.0
NUMBER_SIZE: Final = 11.5
NUMBER_DISTANCE: Final = 4.0
ABOVE_NUMBERS: Final = 6.0  # layer of points that the rim of a number must not hide


def prints(case: Case) -> Sheet:
    """Draw Figure 1: the prints and their minutiae."""
    counts = " and ".join(
        f"{len(side.points)} minutiae of {side.letter}" for side in (case.probe, case.reference)
    )
    caption = (
        f"Two impressions of a finger, and the point patterns that are extracted from them: "
        f"{counts}. The tick is the direction of a minutia. Each panel has its own scale."
    )
    sheet = Sheet("Figure 1. Point patterns from fingerprints", caption, 2, [PANEL_HEIGHT])
    for column, side in enumerate(case.sides):
        axes = sheet.panel(0, column, f"({'ab'[column]}) {called(side)}")
        pixel = show_print(axes, side, FULL)
        angle = side.template.minutiae.angle
        ahead = TICK_PX * pixel * np.column_stack([np.cos(angle), -np.sin(angle)])
        segments(axes, np.stack([side.points, side.points + ahead], axis=1), mark_of(side), OUTLINE)
        dots(axes, side.points, TINTS[side.letter], DOT)
    return sheet


def triangulations(case: Case) -> Sheet:
    """Draw Figure 3: the triangulations of all minutiae."""
    counts = " ".join(
        f"{side.letter}: {len(side.mesh.edges)} edges, {len(side.mesh.triangles)} triangles, "
        f"{int(side.mesh.interior.sum())} closed one-rings."
        for side in case.sides
    )
    caption = (
        f"Delaunay triangulations of all minutiae. {counts} A minutia that only one print shows "
        "changes the one-ring of each of its neighbours."
    )
    sheet = Sheet("Figure 3. Triangulations of the minutiae", caption, 2, [PANEL_HEIGHT])
    for column, side in enumerate(case.sides):
        axes = sheet.panel(0, column, f"({'ab'[column]}) {called(side)}")
        show_print(axes, side)
        segments(axes, side.points[side.mesh.edges], mark_of(side), EDGE)
        dots(axes, side.points, TINTS[side.letter], SMALL_DOT)
    return sheet


def pairs(case: Case) -> Sheet:
    """Draw what either matcher pairs, numbered alike in both prints."""
    default, paper = ({(int(i), int(j)) for i, j in r.pairs} for r in case.results)
    caption = (
        f"Minutiae with the same number are a pair; hollow ones have no partner. The default "
        f"matcher finds {len(default)} pairs, the paper's {len(paper)}; {len(default & paper)} are "
        "the same in both and have the same number in all four panels."
    )
    sheet = Sheet("Pairs of minutiae", caption, 2, [PANEL_HEIGHT, PANEL_HEIGHT])
    number = _numbers(case)
    for row, (result, name) in enumerate(zip(case.results, names(case), strict=True)):
        for column, side in enumerate(case.sides):
            panel = "abcd"[2 * row + column]
            axes = sheet.panel(row, column, f"({panel}) {name}: {side.letter}, {side.name}")
            show_print(axes, side)
            _numbered(axes, side, result, number, column)
    return sheet


def mesh_of_pairs(case: Case) -> Sheet:
    """Draw the Delaunay mesh of the default matcher's pairs in both prints."""
    p, q = paired_points(case, case.default)
    mesh = triangulate(p)
    over = turned_over(mesh.triangles, p, q)
    caption = (
        f"The paired minutiae of P are triangulated, and the same triangles are drawn in Q, so "
        f"that each ring has as many points in Q as in P. {len(mesh.triangles)} triangles; turned "
        f"over in Q (red): {int(over.sum()) or 'none'}."
        f"{_strain(mesh.edges, p, q, case.default)}"
    )
    sheet = Sheet(f"Mesh of the pairs of {names(case)[0]}", caption, 2, [PANEL_HEIGHT])
    for column, (side, points) in enumerate(zip(case.sides, (p, q), strict=True)):
        axes = sheet.panel(0, column, f"({'ab'[column]}) {called(side)}")
        show_print(axes, side)
        for corners in points[mesh.triangles[over]]:
            axes.fill(
                *corners.T, facecolor=hexadecimal(NO_MATCH), alpha=0.5, edgecolor="none",
                zorder=MESHES,
            )  # fmt: skip
        segments(axes, points[mesh.edges], mark_of(side), EDGE)
        dots(axes, points, TINTS[side.letter], SMALL_DOT)
    return sheet


def turned_over(triangles: NDArray[np.int32], p: Floats, q: Floats) -> NDArray[np.bool_]:
    """Return which triangles of P have the other orientation in Q, or no area there.

    Examples
    --------
    >>> p = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    >>> triangle = np.array([[0, 1, 2]], np.int32)
    >>> turned_over(triangle, p, 2 * p).tolist(), turned_over(triangle, p, -p[:, ::-1]).tolist()
    ([False], [True])
    """
    return np.asarray(_areas(triangles, p) * _areas(triangles, q) <= 0)


def _areas(triangles: NDArray[np.int32], points: Floats) -> Floats:
    """Return twice the signed areas of triangles, shape (T,)."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return np.asarray(ux * vy - uy * vx)


def _strain(edges: NDArray[np.int32], p: Floats, q: Floats, result: Verification) -> str:
    """Say by how much edges are longer or shorter in Q than the transform makes them."""
    if result.transform is None or not len(edges):
        return ""
    before, after = (np.hypot(*(xy[edges[:, 1]] - xy[edges[:, 0]]).T) for xy in (p, q))
    known = before > 0
    if not known.any():
        return ""
    off = 100 * np.abs(after[known] / before[known] / result.transform.scale - 1)
    return (
        f" Half of the {len(edges)} edges are more than {np.median(off):.0f} % longer or shorter "
        "in Q than the transform makes them."
    )


def _numbers(case: Case) -> dict[tuple[int, int], int]:
    """Return a number for each pair of either matcher, from the top of P down."""
    every = {(int(i), int(j)) for result in case.results for i, j in result.pairs}
    order = sorted(every, key=lambda pair: (case.probe.points[pair[0]].tolist()[::-1], pair))
    return {pair: n for n, pair in enumerate(order, start=1)}


def _numbered(
    axes: Axes,
    side: CaseSide,
    result: Verification,
    number: dict[tuple[int, int], int],
    column: int,
) -> None:
    """Draw the minutiae of a side, the paired ones full and with their numbers."""
    tint, paired = TINTS[side.letter], result.pairs[:, column]
    alone = np.setdiff1d(np.arange(len(side.points)), paired)
    dots(axes, side.points[alone], tint, SMALL_DOT, hollow=True, layer=ABOVE_NUMBERS)
    dots(axes, side.points[paired], tint, SMALL_DOT, layer=ABOVE_NUMBERS)
    for i, j in result.pairs.tolist():
        at = side.points[(i, j)[column]]
        away = _from_others(at, side.points[paired]) * (1, -1)  # texts are moved with y up
        text = str(number[i, j])
        label(axes, at, text, away=away, distance=NUMBER_DISTANCE, size=NUMBER_SIZE)


def _from_others(at: Floats, points: Floats) -> Floats:
    """Return the direction that leads away from other points, the nearest above all."""
    off = at - points
    squared = (off**2).sum(axis=1)
    others = squared > 0
    if not others.any():
        return np.array([0.0, -1.0])
    return np.asarray((off[others] / squared[others, None] ** 1.5).sum(axis=0))
