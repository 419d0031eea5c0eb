"""The pictures of the default matcher's steps on two prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.items import Path, Pen
from fpmatch.lab.explain import panels as draw
from fpmatch.lab.explain import shared
from fpmatch.lab.explain.default import DefaultMethod
from fpmatch.lab.explain.steps import Step, chosen_pair
from fpmatch.lab.plots.style import degrees, number
from fpmatch.matching import reference as method
from fpmatch.matching.constants.comparison import FRAME
from fpmatch.printable import count

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Box, Item
    from fpmatch.lab.explain.default import PairedMesh
    from fpmatch.matching.parameters import MatchParameters
    from fpmatch.prints.pair import ComparedPair

LIKE: Final = (
    "<i>s<sub>ij</sub></i> = Σ<sub><i>k</i></sub> max<sub><i>l</i></sub> "
    "√(<i>w<sub>k</sub> w<sub>l</sub></i>) · (1 − |Δ<sub><i>kl</i></sub>|² / τ²) · "
    "turn<sub><i>kl</i></sub> / √(<i>m<sub>i</sub> m<sub>j</sub></i>)"
)
SELECT: Final = "(<i>i</i>, <i>j</i>) = arg max <i>s<sub>ij</sub></i>, each minutia once"
RELAX: Final = (
    "<i>r<sub>k</sub></i> = <i>s<sub>ij</sub></i>, then five times <i>r<sub>k</sub></i> ← "
    "½ <i>r<sub>k</sub></i> + ½ Σ<sub><i>l</i></sub> <i>c<sub>kl</sub></i> <i>r<sub>l</sub></i> "
    "/ (<i>K</i> − 1)"
)
PREDICT: Final = "<i>p̂</i> = Σ<sub><i>k</i></sub> λ<sub><i>k</i></sub> <i>q<sub>k</sub></i>"
RIDGES: Final = (
    "<i>r</i> = mean<sub><i>c</i></sub> max<sub>shift</sub> corr(bits<sub><i>P</i></sub>"
    "(<i>c</i>), bits<sub><i>Q</i></sub>(<i>c</i> moved, shifted))"
)
SCORE: Final = (
    "<i>x</i> = Σ<sub><i>f</i></sub> <i>w<sub>f</sub></i> · feature<sub><i>f</i></sub>, "
    "−ln FMR = <i>x</i> given the amount of evidence"
)
KEPT: Final = Pen(palette.MATCH, width=2.0)
LEFT_OUT: Final = Pen(palette.NO_MATCH, width=1.2, opacity=0.6, dash=(5.0, 5.0))
LINK: Final = Pen(palette.PAIR_LINK, width=2.0)
EVIDENCE: Final = (
    *("pairs", "local", "relaxed", "places", "weights", "fullness"),
    *("unpaired", "overlap", "ridges", "cells", "total", "minus_log_fmr"),
)
IN_FRAME: Final = 0.44  # of a panel: how far from its middle the farthest neighbour is


def explain_prints(
    pair: ComparedPair, parameters: MatchParameters, asked: int | None
) -> tuple[list[Step], dict[str, Any]]:
    """Return the steps of the default matcher, and every number in them."""
    m = DefaultMethod.of(pair, parameters)
    chosen = chosen_pair(asked, m.rings, m.candidates.similarity[m.paired].tolist())
    made = [
        shared.points_step(m.sides),
        shared.triangulation_step(m.sides),
        _neighbours(m, chosen),
        *_local(m),
    ]
    if m.matched is None:
        why = "No minutia is paired, so that there is no mesh of pairs: the matcher ends here."
        made.append(Step("mesh_of_pairs", "Mesh of pairs", why))
    else:
        made.append(_mesh(m, m.matched))
        made += _ring(m, m.matched, chosen)
        made.append(_predictions(m, m.matched))
    if pair.verification.ridge_map is not None:
        words = (
            "Eight bits of each cell of the ridges, moved by the mesh of pairs, are compared with "
            "the bits there, under small shifts; the mean over the cells is scored."
        )
        picture = shared.overlay_picture(pair, "ridges")
        made.append(Step("ridges", "Ridges", words, RIDGES, picture))
    if m.matched is not None:
        made.append(_evidence(m.matched))
    return [*made, shared.transform_step(pair)], m.numbers(chosen)


def _neighbours(m: DefaultMethod, chosen: int | None) -> Step:
    """Show the neighbours of a pair in the frame of its minutiae."""
    title, similarity = "Rings: neighbours in the frame of a minutia", m.candidates.similarity
    if chosen is not None:
        pair, what = [int(of[chosen]) for of in m.paired], f"pair {chosen + 1}"
    elif similarity.max(initial=0.0) > 0.0:
        pair = [int(k) for k in np.unravel_index(similarity.argmax(), similarity.shape)]
        what = "the most similar minutiae"
    else:
        return Step("neighbours", title, "No two minutiae have similar neighbours.")
    described = [of.neighbourhoods for of in m.prints]
    frames = [
        of.frame[k, :, : of.count[k]].astype(np.float64)
        for of, k in zip(described, pair, strict=True)
    ]
    boxes = draw.places(shared.THIRDS, shared.RING_HEIGHT)
    items: list[Item] = []
    for side, of, k in zip(m.ordered, described, pair, strict=True):
        near, centre = side.z[of.neighbour[k, : of.count[k]]], complex(side.z[k])
        panel = draw.Panel.of_ring(side, boxes[side.letter == "Q"], near, centre)
        (middle,) = panel.at(side.z[k : k + 1])
        drawn = [
            *draw.edges(panel, side.edges),
            *draw.segments([middle] * len(near), panel.at(near), Pen(side.mark, width=1.2)),
            *draw.dots(panel, near, 5.0),
            draw.shape(side.letter, middle, 7.0, draw.CENTRE),
        ]
        head = f"{side.letter}: minutia {side.index[k]}, {count(len(near), 'neighbour')}"
        items += panel.drawn(head, drawn)
    best = counterparts(frames[0], frames[1], m.parameters.neighbour_cosine)
    drawn = _in_frame(m, frames, best, boxes[2])
    items += draw.framed(boxes[2], "Both, directions to the right", drawn)
    words = (
        f"The neighbours of {what} in the frame of the minutia's direction, as large as their "
        f"weights: {len(best)} of {frames[0].shape[1]} in {m.ordered[0].letter} have a counterpart "
        f"(line), a similarity of {number(float(similarity[*pair]))}. A missing neighbour loses "
        "only its own weight."
    )
    return Step("neighbours", title, words, LIKE, draw.picture(items, words))


def counterparts(ours: NDArray[Any], theirs: NDArray[Any], least: float) -> list[tuple[int, int]]:
    """Return which neighbours of A's minutia, (6, n), count by which of B's, (6, m)."""
    away = ((ours[:2, :, None] - theirs[:2, None]) ** 2).sum(axis=0)
    near = np.maximum(1.0 - away * ours[4][:, None], 0.0)
    turn = np.maximum((ours[2:4, :, None] * theirs[2:4, None]).sum(axis=0) - least, 0.0)
    value = near * turn * theirs[5]
    best = value.argmax(axis=1).tolist() if value.size else []
    return [(k, n) for k, n in enumerate(best) if value[k, n] > 0.0]


def _in_frame(
    m: DefaultMethod, frames: list[Any], best: list[tuple[int, int]], place: Box
) -> list[Item]:
    """Draw the neighbours of two minutiae over each other."""
    extent = max(float(abs(frame[:2]).max(initial=1.0)) for frame in frames)
    zoom = IN_FRAME * min(place.width, place.height) / extent
    x, y = place.x + place.width / 2, place.y + place.height / 2
    at = [[(x + zoom * u, y - zoom * v) for u, v in frame[:2].T.tolist()] for frame in frames]
    items: list[Item] = [Path(((x, y), (x + 60.0, y)), Pen(palette.TEXT, width=3.0))]
    items += [Path((at[0][k], at[1][n]), LINK) for k, n in best]
    for side, spots, frame in zip(m.ordered, at, frames, strict=True):
        full = side.letter == "P"
        pen = Pen(side.mark, side.mark if full else None, width=2.0)
        sizes = (6.0 * frame[5] + (0.0 if full else 2.0)).tolist()
        drawn = zip(spots, sizes, strict=True)
        items += [draw.shape(side.letter, spot, size, pen) for spot, size in drawn]
    return [*items, draw.shape("P", (x, y), 7.0, draw.CENTRE)]


def _local(m: DefaultMethod) -> list[Step]:
    """Show the local matches, and what relaxation keeps of them."""
    c = m.candidates
    pairs = m.as_pq(c.first, c.second)
    if not len(c.first):
        return [Step("local_matches", "Local match", "No two minutiae have similar neighbours.")]
    similar = c.similarity[c.first, c.second].astype(np.float64)
    rejected = method.rejected(*m.prints, m.parameters) is not None
    words = "The prefilter rejects these prints; the steps are shown without it. " * rejected + (
        f"The {count(len(similar), 'most similar pair')} of minutiae, each minutia in one at most; "
        f"the similarity is from {number(similar.min())} to {number(similar.max())} (width of a "
        "line)."
    )
    plain = [LINK._replace(width=0.8 + 4.0 * s / similar.max()) for s in similar]
    relaxed = c.relaxed / (c.relaxed.max() or 1.0)
    strong = [
        KEPT._replace(width=1.0 + 4.0 * r) if kept else LEFT_OUT
        for kept, r in zip(m.kept, relaxed, strict=True)
    ]
    after = (
        "Local matches support each other where distance, direction and rotation from one to the "
        f"other agree in both prints. After five rounds {int(m.kept.sum())} of {len(similar)} have "
        "at least a quarter of the value of the strongest and start the first hypothesis (full "
        "lines); the others are dashed."
    )
    head = "local_matches", "Local match", words, SELECT
    return [
        shared.links_step(m.sides, head, pairs, plain),
        shared.links_step(m.sides, ("relaxation", "Relaxation", after, RELAX), pairs, strong),
    ]


def _mesh(m: DefaultMethod, mesh: PairedMesh) -> Step:
    """Show the mesh of pairs in both prints."""
    inner = mesh.triangles[(mesh.triangles >= FRAME).all(axis=1)]
    items: list[Item] = []
    vertices = m.as_pq(mesh.vertex, mesh.image)
    for panel, vertex, paired in zip(
        draw.two_panels(m.sides), vertices, m.as_pq(*m.paired), strict=True
    ):
        side, at, spots = panel.side, panel.at(vertex), panel.at(panel.side.z[paired])
        corners = [tuple(at[k] for k in triangle) for triangle in inner.tolist()]
        alone, middle = np.delete(side.z, paired), np.mean(spots, axis=0)
        drawn: list[Item] = [
            *(Path(three, Pen(fill=side.ink, opacity=0.2), closed=True) for three in corners),
            *(Path(three, Pen(side.mark, width=1.3), closed=True) for three in corners),
            *draw.dots(panel, alone, 3.0, hollow=True),
            *draw.dots(panel, side.z[paired]),
            *(draw.label(xy, str(n), np.subtract(xy, middle)) for n, xy in enumerate(spots, 1)),
        ]
        items += panel.drawn(f"{side.letter}: {count(len(spots), 'pair')}", drawn)
    same = m.prints[0].key == m.prints[1].key
    how = "a print with itself has" if same else "that grew from these"
    words = (
        f"The {count(len(m.paired[0]), 'pair')} {how}, numbered, make one mesh in both prints, so "
        "that a ring has as many points in P as in Q; eight frame points round the print, not "
        "drawn, close it."
    )
    return Step("mesh_of_pairs", "Mesh of pairs", words, picture=draw.picture(items, words))


def _ring(m: DefaultMethod, mesh: PairedMesh, chosen: int | None) -> list[Step]:
    """Show the ring of the chosen pair on the unit circle, and its weights."""
    ring = None if chosen is None else m.rings[chosen]
    if chosen is None or ring is None:
        why = "No pair has a closed ring in the mesh of pairs."
        return [Step("unit_circle", shared.CIRCLE_TITLE, why)]
    measured, (first, second) = m.measures(mesh, chosen), m.ordered
    words = (
        f"Pair {chosen + 1} and the {len(ring)} points round it. A point of the ring lies on the "
        "circle in proportion to the lengths of the sides before it. The matcher compares the "
        f"places: they differ by {degrees(measured.spread)} (standard deviation), an agreement of "
        f"{number(measured.place_agreement)}."
    )
    more = (
        f"The line from each point of the ring in {first.letter} through the centre crosses a "
        "side; the centre's barycentric coordinates in that triangle, averaged over the points, "
        f"are its weights. The same weights in the ring in {second.letter} predict the partner: "
        f"{number(measured.off, 1)} px from it, an agreement of "
        f"{number(measured.weight_agreement)}."
    )
    weights = np.array(measured.weights)
    return [
        shared.circle_step(ring, words),
        shared.weights_step(ring, int(m.swapped), weights, more),
    ]


def _predictions(m: DefaultMethod, mesh: PairedMesh) -> Step:
    """Show where the mesh of pairs predicts the minutiae of A in B."""
    (first, second), (i, j) = m.ordered, m.paired
    panel = draw.one_panel(second)
    at = panel.at(mesh.predicted)
    alone = np.delete(np.arange(len(at)), i).tolist()
    drawn: list[Item] = [
        *draw.dots(panel, np.delete(second.z, j), hollow=True),
        *draw.dots(panel, second.z[j], 7.0, hollow=True),
        *draw.segments((at[k] for k in i), panel.at(second.z[j]), LINK),
        *(draw.shape(first.letter, at[k], 3.5, Pen(first.mark, first.mark)) for k in i),
        *(draw.shape(first.letter, at[k], 3.5, Pen(first.mark, palette.PAPER)) for k in alone),
    ]
    off = float(abs(mesh.predicted[i] - second.z[j]).mean())
    words = (
        f"Each minutia of {first.letter} is predicted in {second.letter} by its weights in the "
        "ring of pairs round it, also where the skin is stretched, and paired again near there. "
        f"Pairs (full) are {number(off, 1)} px at 500 dpi from their predictions in the mean; "
        f"{len(alone)} of {len(at)} minutiae of {first.letter} have no partner (hollow)."
    )
    if m.swapped:
        words += " Q comes first by its content, so that exchanging the prints changes no pair."
    items = panel.drawn(f"{second.letter}, and where {first.letter} is predicted", drawn)
    return Step("predictions", "Predictions", words, PREDICT, draw.picture(items, words))


def _evidence(mesh: PairedMesh) -> Step:
    """Show what the score is made of."""
    words = (
        "What the pairs, their mesh and the ridges give for and against one finger is summed by a "
        "logistic model; the sum is conditioned on the amount of evidence."
    )
    values = [f"{getattr(mesh.evidence, name):.4g}" for name in EVIDENCE]
    table = [[name.replace("_", " "), value] for name, value in zip(EVIDENCE, values, strict=True)]
    return Step("evidence", "Evidence and score", words, SCORE, table=table)
