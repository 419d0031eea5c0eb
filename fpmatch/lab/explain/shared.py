"""The steps that all matchers take: points, triangulation, unit circle, weights, transform."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.drawing.overlay.draw import View, overlay_scene, scene_bytes
from fpmatch.drawing.overlay.page import BESIDE_PAIRED, marks
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.items import Path, Pen
from fpmatch.lab.explain import panels as draw
from fpmatch.lab.explain.steps import Step, crossed_side
from fpmatch.lab.plots.style import degrees, number, positive_degrees
from fpmatch.printable import count

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Item
    from fpmatch.lab.explain.steps import Ring, Sides
    from fpmatch.prints.pair import ComparedPair

    Numbers = NDArray[np.integer[Any]]

POINT: Final = "<i>p<sub>i</sub></i> = (<i>x<sub>i</sub></i>, <i>y<sub>i</sub></i>)"
DELAUNAY: Final = "|<i>p</i> − <i>c<sub>T</sub></i>| ≥ <i>r<sub>T</sub></i>"
CIRCLE: Final = (
    "<i>A</i><sub>1</sub> = 0, <i>A<sub>k</sub></i><sub>+1</sub> = <i>A<sub>k</sub></i> + "
    "2π · |<i>p<sub>k</sub></i><sub>+1</sub> − <i>p<sub>k</sub></i>| / "
    "Σ<sub><i>l</i></sub> |<i>p<sub>l</sub></i><sub>+1</sub> − <i>p<sub>l</sub></i>|"
)
WEIGHTS: Final = (
    "<i>p</i> = Σ<sub><i>k</i></sub> λ<sub><i>k</i></sub> <i>p<sub>k</sub></i>, "
    "λ<sub><i>k</i></sub> = (1/<i>d</i>) Σ<sub><i>l</i></sub> μ<sub><i>k,l</i></sub>, "
    "Σ<sub><i>k</i></sub> λ<sub><i>k</i></sub> = 1"
)
TRANSFORM: Final = "<i>q</i> = <i>t</i> + <i>s</i> · <i>R</i>(θ) · <i>p</i>"
CIRCLE_TITLE: Final = "Ring and unit circle, eq. (3)"
SMALL: Final = 0.03  # weight by which a point is drawn where weights are not shown
RING_HEIGHT, WEIGHTS_HEIGHT = 380.0, 440.0
THIRDS: Final = (1, 1, 1)


def points_step(sides: Sides) -> Step:
    """Show the points that the matcher is given."""
    items: list[Item] = []
    for panel in draw.two_panels(sides):
        side, drawn = panel.side, draw.dots(panel, panel.side.z)
        if side.print_ is not None:
            style = BESIDE_PAIRED["probe" if side.letter == "P" else "reference"]
            which = side.print_.template.minutiae, side.index.tolist()
            drawn = list(marks(*which, panel.matrix, style))
        title = f"{side.letter}: {count(len(side.z), side.noun, side.nouns)}"
        items += panel.drawn(title, drawn, palette.NEUTRAL_INK)
    words = "The points as the files give them."
    if sides[0].print_ is not None:
        words = "Circle: a ridge ends; square: it forks; tick: the direction of the minutia."
    return Step("points", sides[0].nouns.capitalize(), words, POINT, draw.picture(items, words))


def triangulation_step(sides: Sides) -> Step:
    """Show both triangulations."""
    items: list[Item] = []
    counts = []
    for panel in draw.two_panels(sides):
        side, mesh = panel.side, panel.side.mesh
        drawn = [*draw.edges(panel, side.edges, side.mark), *draw.dots(panel, side.z)]
        items += panel.drawn(f"{side.letter}: {len(mesh.triangles)} triangles", drawn)
        rings = count(int(mesh.interior.sum()), "closed ring")
        counts.append(f"{side.letter} has {len(mesh.edges)} edges and {rings}")
    words = (
        "Delaunay's triangulation defines which points are neighbours: no circle through the "
        f"corners of a triangle T contains another point. {'; '.join(counts)}."
    )
    return Step("triangulation", "Triangulation", words, DELAUNAY, draw.picture(items, words))


def circle_step(
    ring: Ring, words: str, images: tuple[complex | None, complex | None] = (None, None)
) -> Step:
    """Show a ring in both sides, and its places and the images of its centres on one circle."""
    boxes = draw.places(THIRDS, RING_HEIGHT)
    items: list[Item] = []
    circles = []
    for k, (side, box) in enumerate(zip(ring.sides, boxes, strict=False)):
        panel = draw.Panel.of_ring(side, box, ring.points[k], ring.centres[k])
        equal = np.full(len(ring), SMALL)
        drawn = [*draw.edges(panel, ring.edges[k]), *draw.ring(panel, ring, k, equal)]
        items += panel.drawn(f"{side.letter}: the ring", drawn)
        turn = 0.0 if k else ring.turn
        image = images[k]
        turned = None if image is None else complex(image * np.exp(1j * turn))
        circles.append(draw.circle_ring(boxes[2], k, side, ring.angles[k] + turn, turned))
    title = f"Unit circle, P rotated by {degrees(ring.turn)}"
    items += draw.framed(boxes[2], title, [draw.circle_ground(boxes[2]), *circles[0], *circles[1]])
    p, q = ring.angles
    table = [
        ["", *map(str, range(1, len(ring) + 1))],
        *([f"point of {s.letter}", *n] for s, n in zip(ring.sides, ring.names, strict=True)),
        ["place in P, rotated", *map(positive_degrees, p + ring.turn)],
        ["place in Q", *map(positive_degrees, q)],
        ["apart", *map(degrees, ring.apart)],
    ]
    return Step("unit_circle", CIRCLE_TITLE, words, CIRCLE, draw.picture(items, words), table)


def weights_step(ring: Ring, which: int, weights: NDArray[np.float64], words: str) -> Step:
    """Show how the weights of a centre are constructed, and how large they are, in one side."""
    side, points, centre = ring.sides[which], ring.points[which], ring.centres[which]
    first, second = (
        draw.Panel.of_ring(side, box, points, centre) for box in draw.places((1, 1), WEIGHTS_HEIGHT)
    )
    r, crossing = crossed_side(points, centre)
    s = (r + 1) % len(points)
    triangle, line = first.at(points[[0, r, s]]), first.at(np.array([points[0], crossing]))
    construction: list[Item] = [
        *draw.edges(first, ring.edges[which]),
        *draw.ring(first, ring, which, np.full(len(points), SMALL)),
        Path(tuple(triangle), Pen(palette.TEXT, side.ink, 2.0, opacity=0.35), closed=True),
        Path(tuple(line), Pen(palette.TEXT, width=2.0, dash=(6.0, 5.0))),
    ]
    sized = [*draw.edges(second, ring.edges[which]), *draw.ring(second, ring, which, weights)]
    how = f"the line from 1 crosses the side from {r + 1} to {s + 1}"
    items = [
        *first.drawn(f"{side.letter}: {how}", construction),
        *second.drawn(f"{side.letter}: points as large as their weights", sized),
    ]
    table = [
        ["", *map(str, range(1, len(ring) + 1)), "Σ"],
        ["weight λ", *map(number, (*weights, weights.sum()))],
    ]
    title = "Floater's weights, eq. (4)"
    return Step("weights", title, words, WEIGHTS, draw.picture(items, words), table)


def links_step(
    sides: Sides, head: Sequence[str], pairs: tuple[Numbers, Numbers], pens: Sequence[Pen]
) -> Step:
    """Show both sides with a link from each point of P to one of Q, the first of them on top.

    `head` is the name, title, sentence and equation of the step.
    """
    both = draw.two_panels(sides)
    items: list[Item] = []
    for panel in both:
        title = f"{panel.side.letter}: {panel.side.name}"
        items += panel.drawn(title, draw.dots(panel, panel.side.z))
    p, q = (panel.at(panel.side.z[of]) for panel, of in zip(both, pairs, strict=True))
    links = [Path((a, b), pen) for a, b, pen in zip(p, q, pens, strict=True)]
    name, title, words, equation = head
    return Step(name, title, words, equation, draw.picture([*items, *links[::-1]], words))


def transform_step(pair: ComparedPair) -> Step:
    """Show the transform of the probe over the reference."""
    v = pair.verification
    words = "One similarity transform is fitted to the pairs by least squares; it moves P over Q."
    if v.transform is None:
        words = "No transform was found: the prints are shown side by side."
    elif not v.match:
        words += " The prints do not match: this is the best transform there is."
    return Step("transform", "Transform, eq. (1)", words, TRANSFORM, overlay_picture(pair))


def overlay_picture(pair: ComparedPair, view: View = "superposed") -> bytes:
    """Return the picture that ``verify --overlay`` draws, as SVG."""
    images = pair.probe.pixels, pair.reference.pixels
    return scene_bytes(".svg", overlay_scene(*images, pair.verification, view))


def numbers_of(sides: Sides) -> dict[str, Any]:
    """Return points and triangulations for JSON."""
    return {
        side.letter.lower(): {
            "name": side.name,
            "index": side.index.tolist(),
            "points": side.given(side.z),
            "edges": side.mesh.edges.tolist(),
            "triangles": side.mesh.triangles.tolist(),
            "closed_rings": int(side.mesh.interior.sum()),
        }
        for side in sides
    }
