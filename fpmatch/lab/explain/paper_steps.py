"""The pictures of the paper's steps on two point sets, or on the positions of minutiae."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.items import Pen
from fpmatch.lab.explain import panels as draw
from fpmatch.lab.explain import shared
from fpmatch.lab.explain.steps import Step, chosen_pair
from fpmatch.lab.plots.style import degrees, number, significant
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.printable import count

if TYPE_CHECKING:
    from fpmatch.drawing.scene.items import Item
    from fpmatch.lab.explain.paper import PaperMethod

MOST_LINKS: Final = 1500  # local matches drawn that are not pairs of the result
MOST_NUMBERED: Final = 100  # pairs
UPWARDS: Final = np.array([1.0, -1.0])
AREA: Final = (
    "<i>a</i> = ½ Σ<sub><i>k</i></sub> sin(<i>A<sub>k</sub></i><sub>+1</sub> − "
    "<i>A<sub>k</sub></i>), |<i>a<sub>P</sub></i> − <i>a<sub>Q</sub></i>| ≤ "
)
GLOBAL: Final = (
    "|<i>t</i> + <i>s</i> · <i>R</i>(θ) · <i>p</i> − <i>q</i>| ≤ λ · <i>r</i> / (2 √<i>n</i>)"
)
RIGHT: Final = Pen(palette.MATCH, width=2.4)
OTHER: Final = Pen(palette.NEUTRAL_INK, width=0.8, opacity=0.25)


def explain_points(m: PaperMethod, asked: int | None) -> tuple[list[Step], dict[str, Any]]:
    """Return the steps of the paper's matcher, and every number in them."""
    chosen = chosen_pair(asked, m.rings, [m.agreement(ring) for ring in m.rings])
    made = [
        shared.points_step(m.sides),
        shared.triangulation_step(m.sides),
        *_ring(m, chosen),
        _local(m),
        _global(m),
    ]
    return made, m.numbers(chosen)


def _ring(m: PaperMethod, chosen: int | None) -> list[Step]:
    """Show the ring of the chosen pair on the unit circle, and its weights."""
    ring = None if chosen is None else m.rings[chosen]
    both = None if chosen is None else m.circles(chosen)
    if chosen is None or ring is None or both is None:
        why = "No pair has a closed ring with as many points in P as in Q."
        return [Step("unit_circle", shared.CIRCLE_TITLE, why)]
    p, q = both
    i, j = m.match.pairs[chosen].tolist()
    limit = m.parameters.area_tolerance
    words = (
        f"Pair {chosen + 1}: {m.sides[0].noun} {i} of P and {j} of Q, and the {len(ring)} points "
        "round each. A point of the ring lies on the circle in proportion to the lengths of the "
        f"sides before it. The circles agree best where P's is rotated by {degrees(ring.turn)}; "
        f"hollow: Q. The areas of the polygons, {number(p.area)} and {number(q.area)}, "
        f"{'match' if abs(p.area - q.area) <= limit else 'do not match'} within {limit:g}."
    )
    more = (
        "The line from each point of the ring through the centre crosses a side; the centre's "
        "barycentric coordinates in that triangle, averaged over the points, are its weights, "
        "which also place the image of the centre in the circle."
    )
    return [
        shared.circle_step(ring, words, (p.image, q.image)),
        shared.weights_step(ring, 0, p.weights, more),
    ]


def _local(m: PaperMethod) -> Step:
    """Show the rings that match locally."""
    i, j = m.centres
    title, limit = "Local match", m.parameters.area_tolerance
    if not len(i):
        return Step("local_matches", title, "No closed ring of P is similar to one of Q.")
    pairs = set(map(tuple, m.match.pairs.tolist()))
    right = np.array([pair in pairs for pair in zip(i.tolist(), j.tolist(), strict=True)])
    others = np.flatnonzero(~right)
    drawn = others[:: math.ceil(len(others) / MOST_LINKS) or 1]
    order = np.append(np.flatnonzero(right), drawn)
    part = "" if len(drawn) == len(others) else f"; {len(drawn)} of them are drawn"
    p, q = m.prepared
    words = (
        f"Of {count(len(p.rings), 'closed ring')} in P and {len(q.rings)} in Q, "
        f"{count(len(i), 'combination')} have as many points and areas that differ by at most "
        f"{limit:g}. Each proposes a transform. Pairs of the result are strong "
        f"({int(right.sum())}), the others ({len(others)}) faint{part}."
    )
    head = "local_matches", title, words, f"{AREA}{limit:g}"
    pens = [*[RIGHT] * int(right.sum()), *[OTHER] * len(drawn)]
    return shared.links_step(m.sides, head, (i[order], j[order]), pens)


def _global(m: PaperMethod) -> Step:
    """Show P, moved by the best transform, over Q."""
    title, match, (p, q) = "Global match, eq. (2)", m.match, m.sides
    if not isinstance(match.transform, Similarity):
        why = "No transform maps points of one set onto points of the other."
        return Step("global_match", title, why)
    xy = match.transform.apply(np.column_stack([p.z.real, p.z.imag]))
    moved = xy[:, 0] + 1j * xy[:, 1]
    i, j = match.pairs.T
    panel = draw.one_panel(q, np.append(moved, q.z))
    at = panel.at(moved)
    drawn: list[Item] = [
        *draw.edges(panel, q.edges, draw.PALE),
        *draw.dots(panel, q.z, 7.0, hollow=True),
        *draw.segments((at[k] for k in i), panel.at(q.z[j]), Pen(palette.PAIR_LINK, width=2.0)),
        *(draw.shape("P", at[k], 3.5, Pen(p.mark, p.mark)) for k in i),
        *(draw.shape("P", xy, 3.5, Pen(p.mark, palette.PAPER)) for xy in np.delete(at, i, axis=0)),
    ]
    if len(i) <= MOST_NUMBERED:
        spots = [at[k] for k in i]
        drawn += [draw.label(spot, str(n), UPWARDS, 20.0) for n, spot in enumerate(spots, start=1)]
    turn = math.remainder(match.transform.rotation, 2 * math.pi)
    sense = "counter-clockwise" if (turn > 0.0) == p.up else "clockwise"
    scale = match.transform.scale * q.unit / p.unit
    words = (
        f"Of {count(len(m.local), 'proposal')} the transform under which the most points coincide, "
        f"refitted to them, is the result: P rotated by {degrees(abs(turn))} {sense}, "
        f"scaled by {significant(scale)}. It pairs "
        f"{len(i)} points, {match.matched_share:.1%} of the smaller set, within "
        f"{significant(m.tolerance)}; by the paper's rule more than {m.rho:.4g} are a match: "
        f"{'match' if m.matches else 'no match'}."
    )
    items = panel.drawn("P (full: paired), moved over Q", drawn)
    return Step("global_match", title, words, GLOBAL, draw.picture(items, words))
