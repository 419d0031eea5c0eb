"""Prints with minutiae, triangulations, pairs and overlays: the paper's Figures 1, 3 and 8."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.drawing.scene.palette import NO_MATCH, PROBE_INK, REFERENCE_INK, hexadecimal
from fpmatch.lab.paper_figures import marks
from fpmatch.lab.paper_figures.rotation import matched_dots
from fpmatch.lab.paper_figures.sheet import Sheet, show
from fpmatch.lab.plots.words import degrees, number
from fpmatch.pointset.delaunay.triangulate import triangulate
from research.case_study.case import FADED, show_pixels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.verification import Verification
    from research.case_study.case import Case

    Floats = NDArray[np.float64]

HEIGHT: Final = 432
FULL: Final = 0.75  # share of a print's contrast in the figure of the prints
TICK_PX: Final = 13.0  # length of a direction's tick on the page
DOT, SMALL_DOT = 7.0, 5.0
STACKED_SHARE: Final = 0.85  # of the size of points that lie on each other, in other figures
NUMBER_SIZE, NUMBER_DISTANCE = 11.5, 4.0


def prints(case: Case) -> Sheet:
    """Draw Figure 1: the prints and their minutiae."""
    counts = " and ".join(f"{len(s.points)} minutiae of {s.letter}" for s in case.sides)
    caption = (
        f"Two impressions of a finger, and the point patterns extracted from them: "
        f"{counts}. The tick is the direction of a minutia. Each panel has its own scale."
    )
    sheet = Sheet("Figure 1. Point patterns from fingerprints", caption, ["ab"], [HEIGHT])
    for key, side in zip("ab", case.sides, strict=True):
        axes = sheet.panel(key, f"({key}) {side.title}")
        pixel = side.show(axes, FULL)
        angle = side.template.minutiae.angle
        ahead = TICK_PX * pixel * np.column_stack([np.cos(angle), -np.sin(angle)])
        ticks = np.stack([side.points, side.points + ahead], axis=1)
        marks.segments(axes, ticks, side.tint.mark, marks.OUTLINE)
        marks.dots(axes, side.points, side.tint, DOT)
    return sheet


def triangulations(case: Case) -> Sheet:
    """Draw Figure 3: the triangulations of all minutiae."""
    counts = " ".join(
        f"{side.letter}: {len(side.mesh.edges)} edges, {len(side.mesh.triangles)} triangles, "
        f"{int(side.mesh.interior.sum())} closed one-rings."
        for side in case.sides
    )
    caption = (
        f"Delaunay triangulations of all minutiae. {counts} A minutia that occurs in only one "
        "print changes the one-ring of each of its neighbours."
    )
    sheet = Sheet("Figure 3. Triangulations of the minutiae", caption, ["ab"], [HEIGHT])
    for key, side in zip("ab", case.sides, strict=True):
        axes = sheet.panel(key, f"({key}) {side.title}")
        side.show(axes)
        marks.mesh_lines(axes, side.mesh, side.tint.mark)
        marks.dots(axes, side.points, side.tint, SMALL_DOT)
    return sheet


def pairs(case: Case) -> Sheet:
    """Draw the pairs of either matcher; a pair has the same number in all panels."""
    default, paper = ({*map(tuple, r.pairs.tolist())} for r in case.results.values())
    caption = (
        f"Minutiae with the same number are a pair; hollow ones have no partner. The default "
        f"matcher finds {len(default)} pairs, the paper's {len(paper)}; {len(default & paper)} are "
        "the same in both and have the same number in all four panels."
    )
    sheet = Sheet("Pairs of minutiae", caption, ["ab", "cd"], [HEIGHT, HEIGHT])
    order = sorted(default | paper, key=lambda pair: (*case.probe.points[pair[0]][::-1], pair))
    numbers = {pair: str(n) for n, pair in enumerate(order, start=1)}
    for keys, (name, result) in zip(("ab", "cd"), case.results.items(), strict=True):
        for column, (key, side) in enumerate(zip(keys, case.sides, strict=True)):
            axes = sheet.panel(key, f"({key}) {name}: {side.letter}, {side.name}")
            side.show(axes)
            paired = side.points[result.pairs[:, column]]
            alone = np.delete(side.points, result.pairs[:, column], axis=0)
            marks.dots(axes, alone, side.tint, SMALL_DOT, hollow=True)
            marks.dots(axes, paired, side.tint, SMALL_DOT)
            texts = [numbers[i, j] for i, j in result.pairs.tolist()]
            _write_numbers(axes, paired, texts)
    return sheet


def _write_numbers(axes: Axes, points: Floats, texts: list[str]) -> None:
    """Write a number beside each point, away from the others, above all the nearest."""
    for at, text in zip(points, texts, strict=True):
        off = at - points
        squared = (off**2).sum(axis=1)
        others = squared > 0
        right, down = (off[others] / squared[others, None] ** 1.5).sum(axis=0)
        away = (right, -down) if others.any() else (0.0, 1.0)  # labels are moved with y up
        marks.label(axes, at, text, away=away, distance=NUMBER_DISTANCE, size=NUMBER_SIZE)


def mesh_of_pairs(case: Case) -> Sheet:
    """Draw the Delaunay mesh of the default matcher's pairs in both prints."""
    p, q = case.paired_points
    mesh = triangulate(p)
    over = turned_over(mesh.triangles, p, q)
    caption = (
        f"The paired minutiae of P are triangulated, and the same triangles are drawn in Q, so "
        f"that each ring has as many points in Q as in P. {len(mesh.triangles)} triangles; turned "
        f"over in Q (red): {int(over.sum()) or 'none'}.{_strain(mesh.edges, p, q, case.default)}"
    )
    sheet = Sheet(f"Mesh of the pairs of {case.default_name}", caption, ["ab"], [HEIGHT])
    for key, side, points in zip("ab", case.sides, (p, q), strict=True):
        axes = sheet.panel(key, f"({key}) {side.title}")
        side.show(axes)
        for corners in points[mesh.triangles[over]]:
            red = hexadecimal(NO_MATCH)
            axes.fill(*corners.T, facecolor=red, alpha=0.5, zorder=marks.MESHES, linewidth=0)
        marks.segments(axes, points[mesh.edges], side.tint.mark, marks.EDGE)
        marks.dots(axes, points, side.tint, SMALL_DOT)
    return sheet


def turned_over(triangles: NDArray[np.int32], p: Floats, q: Floats) -> NDArray[np.bool_]:
    """Return which triangles of P have the other orientation in Q, or no area there."""
    return np.asarray(_areas(triangles, p) * _areas(triangles, q) <= 0)


def _areas(triangles: NDArray[np.int32], points: Floats) -> Floats:
    """Return twice the signed areas of triangles, shape (T,)."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return np.asarray(ux * vy - uy * vx)


def _strain(edges: NDArray[np.int32], p: Floats, q: Floats, result: Verification) -> str:
    """Return a sentence on the lengths of edges in Q, compared with the transform's."""
    if result.transform is None or not len(edges):
        return ""
    before, after = (np.hypot(*(xy[edges[:, 1]] - xy[edges[:, 0]]).T) for xy in (p, q))
    known = before > 0
    if not known.any():
        return ""
    off = 100 * np.abs(after[known] / before[known] / result.transform.scale - 1)
    return (
        f" Half of the {len(edges)} edges are more than {np.median(off):.0f} % longer or shorter "
        "in Q than according to the transform."
    )


def overlays(case: Case) -> Sheet:
    """Draw Figure 8: P over Q under the transform of either matcher."""
    found = " ".join(f"{name}: {_transform_text(r)}" for name, r in case.results.items())
    caption = (
        "P (blue, dots), moved by the similarity transform of eq. (1), over Q (orange, squares); "
        f"pairs are linked, hollow dots and single squares have no partner. {found}"
    )
    sheet = Sheet("Figure 8. The match that was found", caption, ["ab"], [HEIGHT])
    p, q = case.probe.points, case.reference.points
    for key, (name, result) in zip("ab", case.results.items(), strict=True):
        axes = sheet.panel(key, f"({key}) {name}: {len(result.pairs)} pairs")
        show(axes, case.reference.view, y_down=True)
        show_pixels(axes, _overprinted(case, result))
        if result.transform is None:
            marks.dots(axes, q, case.reference.tint, hollow=True)
        else:
            moved = result.transform.apply(p)
            matched_dots(axes, moved, q, result.pairs, STACKED_SHARE, 2 * marks.EDGE)
    return sheet


def _transform_text(result: Verification) -> str:
    t = result.transform
    if t is None:
        return "no transform found."
    sense = "clockwise" if t.rotation >= 0 else "counter-clockwise"  # y points down
    return (
        f"rotation {degrees(abs(t.rotation))} {sense}, scale {number(t.scale)}, shift "
        f"({number(t.tx, 0)}, {number(t.ty, 0)}) px, pairs {number(result.rms_px, 1)} px apart "
        "(rms)."
    )


def _overprinted(case: Case, result: Verification) -> NDArray[np.uint8]:
    """Return Q in orange ink, and P, moved, in blue over it, where there is a transform."""
    q = _inked(case.reference.pixels, REFERENCE_INK)
    if result.transform is None:
        return np.rint(q).astype(np.uint8)
    rows, columns = case.reference.pixels.shape
    matrix = np.asarray(result.transform.matrix, np.float64)
    moved = cv2.warpAffine(
        case.probe.pixels, matrix, (columns, rows), flags=cv2.INTER_LINEAR, borderValue=(255,)
    )
    p = _inked(np.asarray(moved, np.uint8), PROBE_INK)
    return np.rint(p * q / 255.0).astype(np.uint8)


def _inked(pixels: NDArray[np.uint8], ink: Colour) -> Floats:
    """Return a print in one ink on white, faded, RGB."""
    share = 2 * FADED * (255.0 - pixels[..., None]) / 255.0
    return np.asarray(255.0 - share * (255.0 - np.array(ink, np.float64)))
