"""One ring in both prints and on the unit circle, with the weights of its centre."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.lab.paper_figures.marks import ring_in_mesh, table
from fpmatch.lab.paper_figures.pair import PointPair, PointSide
from fpmatch.lab.paper_figures.rings import RingPair, as_complex, choose_ring_pair
from fpmatch.lab.paper_figures.rotation import aligned_circles
from fpmatch.lab.paper_figures.sheet import Sheet
from fpmatch.lab.plots.words import degrees, number, positive_degrees
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from research.case_study.case import Case

    Floats = NDArray[np.float64]

HEIGHTS: Final = (322, 322)
RING_ROOM: Final = 44.0


def ring_of_pairs(case: Case) -> Sheet | None:
    """Draw a ring of the mesh of the default matcher's pairs; None where it has none."""
    p, q = case.paired_points
    every = np.arange(len(p), dtype=np.int32)
    rings = _ring_pair(p, q, np.column_stack([every, every]), "the pairs")
    if rings is None:
        return None
    caption = (
        f"A pair and the {len(rings.p)} pairs around it in the mesh. Each point of the ring in "
        f"P has a known partner in Q, so that place and weight are compared point by point. "
        f"{_differences(rings)} y points down, as in images; angles are counter-clockwise."
    )
    return _sheet(f"A ring of the pairs of {case.default_name} on the unit circle", caption, rings)


def ring_of_minutiae(case: Case) -> Sheet | None:
    """Draw a ring of all minutiae that is complete in both prints; None where there is none."""
    p, q = case.probe.points, case.reference.points
    rings = _ring_pair(p, q, case.paper.pairs, "the minutiae")
    if rings is None:
        return None
    p_area, q_area = number(rings.p.circle.area), number(rings.q.circle.area)
    caption = (
        f"A minutia that the paper's matcher pairs, and the {len(rings.p)} minutiae around it in "
        f"the triangulation of all minutiae, the same in both prints. Local matching compares the "
        f"areas of the polygons on the circle: {p_area} and {q_area}. {_differences(rings)}"
    )
    title = "A ring of all minutiae on the unit circle, as for the paper's matcher"
    return _sheet(title, caption, rings)


def _differences(rings: RingPair) -> str:
    weights = np.abs(rings.q.circle.weights[rings.partner] - rings.p.circle.weights)
    return (
        f"The places are {degrees(float(np.abs(rings.deviations).mean()))} apart in the mean, the "
        f"weights {number(weights.mean())}."
    )


def _ring_pair(p: Floats, q: Floats, pairs: NDArray[np.int32], source: str) -> RingPair | None:
    """Return the ring that is easiest to read, its points paired with their partners."""
    try:
        first = PointSide.of("P", source, p, y_down=True)
        second = PointSide.of("Q", source, q, y_down=True)
        rings = choose_ring_pair(PointPair(first, second, pairs, Similarity(), "", "", True))
    except PointSetError:
        return None
    a, b = (as_complex(ring.circle.boundary) for ring in (rings.p, rings.q))
    turn = float(np.angle((a.conj() * np.roll(b, -rings.true_shift)).sum()))
    return replace(rings, shift=rings.true_shift, turn=turn)


def _sheet(title: str, caption: str, rings: RingPair) -> Sheet:
    sheet = Sheet(title, caption, ["ab", "cd"], HEIGHTS)
    p, q = rings.p.circle, rings.q.circle
    for key, ring in zip("ab", (rings.p, rings.q), strict=True):
        axes = sheet.panel(key, f"({key}) the ring in {ring.side.letter}")
        ring_in_mesh(axes, ring, RING_ROOM)
    aligned_circles(sheet, "c", rings)
    columns = (
        ["", *rings.names, "Σ"],
        ["P, rotated", *map(positive_degrees, p.angles + rings.turn), ""],
        ["Q", *map(positive_degrees, q.angles[rings.partner]), ""],
        ["weight in P", *map(number, (*p.weights, p.weights.sum()))],
        ["in Q", *map(number, (*q.weights[rings.partner], q.weights.sum()))],
    )
    axes = sheet.panel("d", "(d) places on the circle, weights of the centre")
    table(axes, list(zip(*columns, strict=True)))
    return sheet
