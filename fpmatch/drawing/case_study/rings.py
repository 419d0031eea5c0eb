"""One ring in both prints and on the unit circle, with the weights of its centre."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.case_study.case import names, paired_points
from fpmatch.drawing.paper_figures.choice import choose_ring_pair
from fpmatch.drawing.paper_figures.marks import MESH, mesh_lines, ring_lines, ring_names
from fpmatch.drawing.paper_figures.pair import PointPair, PointSide, upright
from fpmatch.drawing.paper_figures.ring import as_complex
from fpmatch.drawing.paper_figures.sheet import Sheet, show
from fpmatch.drawing.paper_figures.table import table
from fpmatch.drawing.paper_figures.two_circles import laid_over
from fpmatch.drawing.paper_figures.words import degrees, name, number
from fpmatch.errors import PointSetError
from fpmatch.pointset.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.drawing.case_study.case import Case
    from fpmatch.drawing.paper_figures.ring import RingPair

    Floats = NDArray[np.float64]

PANEL_HEIGHT: Final = 330
RING_ROOM: Final = 44.0


def ring_of_pairs(case: Case) -> Sheet | None:
    """Draw a ring of the mesh of the default matcher's pairs; None where it has none."""
    p, q = paired_points(case, case.default)
    every = np.arange(len(p), dtype=np.int32)
    rings = _ring_pair(p, q, np.column_stack([every, every]), "the pairs")
    if rings is None:
        return None
    caption = (
        f"A pair and the {len(rings.p)} pairs around it in the mesh. Of every point of the ring in "
        f"P the partner in Q is known, so that place and weight are compared point by point. The "
        f"places are {degrees(_off(rings))} apart in the mean, the weights "
        f"{number(_weights_apart(rings))}. y points down, as in images; angles are "
        "counter-clockwise."
    )
    return _sheet(f"A ring of the pairs of {names(case)[0]} on the unit circle", caption, rings)


def ring_of_minutiae(case: Case) -> Sheet | None:
    """Draw a ring of all minutiae that is whole in both prints; None where there is none."""
    p, q = case.probe.points, case.reference.points
    rings = _ring_pair(p, q, case.paper.pairs, "the minutiae")
    if rings is None:
        return None
    p_area, q_area = rings.p.circle.area, rings.q.circle.area
    caption = (
        f"A minutia that the paper's matcher pairs, and the {len(rings.p)} minutiae around it in "
        f"the triangulation of all minutiae; both prints show these and no other. Local matching "
        f"compares the areas of the polygons on the circle: {number(p_area)} and {number(q_area)}. "
        f"The places are {degrees(_off(rings))} apart in the mean, the weights "
        f"{number(_weights_apart(rings))}."
    )
    return _sheet(
        "A ring of all minutiae on the unit circle, as for the paper's matcher", caption, rings
    )


def _ring_pair(p: Floats, q: Floats, pairs: NDArray[np.int32], source: str) -> RingPair | None:
    """Return the ring that is easiest to read, its points joined with their partners."""
    try:
        first = PointSide.of("P", source, upright(p))
        second = PointSide.of("Q", source, upright(q))
        pair = PointPair(first, second, pairs, Similarity(), "", "", y_down=True)
        rings = choose_ring_pair(pair)
    except PointSetError:
        return None
    a, b = (as_complex(ring.circle.boundary) for ring in (rings.p, rings.q))
    turn = float(np.angle((a.conj() * np.roll(b, -rings.true_shift)).sum()))
    return replace(rings, shift=rings.true_shift, turn=turn)


def _sheet(title: str, caption: str, rings: RingPair) -> Sheet:
    sheet = Sheet(title, caption, 2, [PANEL_HEIGHT, PANEL_HEIGHT])
    for column, ring in enumerate((rings.p, rings.q)):
        letter = ring.side.letter
        axes = sheet.panel(0, column, f"({'ab'[column]}) the ring in {letter}")
        show(axes, ring.points, RING_ROOM)
        mesh_lines(axes, ring.side.mesh, MESH)
        ring_lines(axes, ring)
        ring_names(axes, ring, in_mesh=True)
    axes = sheet.panel(
        1, 0, f"(c) P's circle turned by {degrees(math.degrees(rings.turn))}, on Q's"
    )
    laid_over(axes, rings)
    axes = sheet.panel(1, 1, "(d) places on the circle, weights of the centre", framed=False)
    rows = [
        [
            f"{name('P', k)} {name('Q', int(n))}",
            degrees(math.degrees(rings.p.circle.angles[k] + rings.turn) % 360),
            degrees(math.degrees(rings.q.circle.angles[n]) % 360),
            number(rings.p.circle.weights[k]),
            number(rings.q.circle.weights[n]),
        ]
        for k, n in enumerate(rings.partner)
    ]
    sums: Sequence[str] = [
        "Σ",
        "",
        "",
        *(number(r.circle.weights.sum()) for r in (rings.p, rings.q)),
    ]
    table(axes, ["", "P, turned", "Q", "weight in P", "in Q"], rows, sums)
    return sheet


def _off(rings: RingPair) -> float:
    """Return the mean distance of the places on the circle after the turn, in degrees."""
    off = rings.q.circle.angles[rings.partner] - rings.p.circle.angles - rings.turn
    return float(np.degrees(np.abs(np.angle(np.exp(1j * off)))).mean())


def _weights_apart(rings: RingPair) -> float:
    apart = rings.q.circle.weights[rings.partner] - rings.p.circle.weights
    return float(np.abs(apart).mean())
