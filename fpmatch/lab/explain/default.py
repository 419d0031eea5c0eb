"""The steps of the default matcher on two prints, by the functions of the reference matcher."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.drawing.overlay.draw import overlay_scene, scene_bytes
from fpmatch.drawing.scene.ink import print_picture
from fpmatch.lab.explain import pictures as draw
from fpmatch.lab.explain.pictures import FRAME_NAME, Ring, Side, Step, clearest
from fpmatch.matching import constants as fixed
from fpmatch.matching import reference as method
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline.evidence import FEATURES, amount_terms, load_weights
from fpmatch.matching.reference.evidence import features_of, most_decades
from fpmatch.matching.reference.neighbourhood import local_similarity
from fpmatch.matching.reference.pair_mesh import measure
from fpmatch.matching.reference.relaxation import relax
from fpmatch.pointset.paper.parametrize import ring_angles, ring_weights

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from fpmatch.lab.explain.pictures import Letter, Sides
    from fpmatch.matching.pipeline.evidence import Evidence
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.reference.alignment import Pairing
    from fpmatch.matching.reference.relaxation import Candidates
    from fpmatch.prints.pair import ComparedPair
    from fpmatch.prints.reading import GivenPrint

    Numbers = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class DefaultMethod:
    """The steps on two prints: A is the first of them in the order of content."""

    sides: Sides
    prints: tuple[PreparedTemplate, PreparedTemplate]  # A, B
    swapped: bool  # whether A is Q
    candidates: Candidates
    matched: tuple[Pairing, Evidence] | None
    parameters: MatchParameters

    @classmethod
    def of(
        cls, probe: GivenPrint, reference: GivenPrint, parameters: MatchParameters = USUAL
    ) -> DefaultMethod:
        """Take the steps of the reference matcher on two prints."""
        p, q = (method.prepare(one.template, parameters) for one in (probe, reference))
        sides = _side("P", probe, p), _side("Q", reference, q)
        swapped = q.key < p.key
        a, b = (q, p) if swapped else (p, q)
        matched = method.match(a, b, parameters) if min(len(a), len(b)) else None
        similarity = local_similarity(a.neighbourhoods, b.neighbourhoods, parameters)
        candidates = relax(a.points, b.points, similarity, parameters)
        return cls(sides, (a, b), swapped, candidates, matched, parameters)

    @property
    def ordered(self) -> Sides:
        """The sides of A and B."""
        return (self.sides[1], self.sides[0]) if self.swapped else self.sides

    def as_pq(self, of_a: Any, of_b: Any) -> tuple[Any, Any]:
        """Return what A and B have as P and Q have it."""
        return (of_b, of_a) if self.swapped else (of_a, of_b)

    @cached_property
    def paired(self) -> tuple[Numbers, Numbers]:
        """Minutiae of A and B that are paired, in the order of P."""
        if self.matched is None:
            return np.empty(0, np.intp), np.empty(0, np.intp)
        partner = self.matched[0].partner
        i = np.flatnonzero(partner >= 0)
        order = np.argsort(partner[i] if self.swapped else i, kind="stable")
        return i[order], partner[i][order]

    @cached_property
    def rings(self) -> dict[int, Ring]:
        """The rings of pairs in the mesh of pairs, by the places of those that have one."""
        if self.matched is None:
            return {}
        pairing, mesh = self.matched[0], self.matched[0].mesh[0]
        places = enumerate(np.transpose(self.paired).tolist())
        return {k: self._ring(pairing, i, j) for k, (i, j) in places if mesh.once(i).any()}

    def _ring(self, pairing: Pairing, i: int, j: int) -> Ring:
        mesh, (a, b) = pairing.mesh[0], pairing.places
        ring = mesh.rings[i, mesh.once(i)]
        owner = mesh.owner[ring]
        names = [
            [FRAME_NAME if k < 0 else str(n) for k, n in zip(owner, side.index[of], strict=True)]
            for side, of in zip(self.ordered, (owner, pairing.partner[owner]), strict=True)
        ]
        angles = self.as_pq(*(ring_angles(of[ring]) for of in (mesh.vertex, mesh.image)))
        ends = np.stack([mesh.triangles, np.roll(mesh.triangles, -1, axis=1)], axis=2)
        edges = np.unique(np.sort(ends.reshape(-1, 2), axis=1), axis=0)
        return Ring(
            sides=self.sides,
            centres=self.as_pq(complex(a[i]), complex(b[j])),
            points=self.as_pq(mesh.vertex[ring], mesh.image[ring]),
            names=self.as_pq(*names),
            edges=self.as_pq(mesh.vertex[edges], mesh.image[edges]),
            angles=angles,
            turn=float((angles[1] - angles[0]).mean()),
        )


def _side(letter: Letter, given: GivenPrint, prepared: PreparedTemplate) -> Side:
    z = prepared.points[0] + 1j * prepared.points[1]
    return Side(letter, given.name, z, prepared.index.astype(np.intp), given, flipped=True)


def explain_prints(m: DefaultMethod, pair: ComparedPair | None) -> list[Step]:
    """Return the steps of the default matcher; `pair` is the comparison, if there is one."""
    made = [draw.triangulation_step(m.sides), *(_local(m) if len(m.candidates.first) else [])]
    if m.matched is None:
        return [*made, Step("nothing_paired")]
    pairing, evidence = m.matched
    chosen = clearest(m.rings, m.candidates.similarity[m.paired].tolist())
    made += [_mesh(m, pairing), *_ring_steps(m, pairing, chosen)]
    predicted, partner = pairing.mesh[1], pairing.places[1][pairing.partner]
    numbers = {
        "first": m.ordered[0].letter,
        "off": float(abs(predicted - partner)[m.paired[0]].mean()),
        "at": m.ordered[1].shown(predicted).tolist(),
    }
    made.append(Step("predictions", draw.superposed(m.ordered, predicted, m.paired), numbers))
    if pair is not None and pair.verification.ridge_map is not None:
        images = print_picture(pair.probe), print_picture(pair.reference)
        ridges = overlay_scene(*images, pair.verification, "ridges")
        made.append(Step("ridges", scene_bytes(".svg", ridges)))
    made.append(_evidence(m, evidence, pair))
    (linear, shift), z = pairing.move, m.sides[0].z
    moved = (z - shift) / linear if m.swapped else linear * z + shift
    picture = draw.superposed(m.sides, moved, m.as_pq(*m.paired))
    reason = "" if pair is None else pair.verification.reason
    return [*made, Step("transform", picture, {"reason": reason})]


def _local(m: DefaultMethod) -> list[Step]:
    """Show the local matches, as wide as they are similar after relaxation."""
    c, p = m.candidates, m.parameters
    similar = c.similarity[c.first, c.second].astype(np.float64)
    left = c.relaxed / similar
    kept = np.zeros(len(left), bool) if m.matched is None else c.among(m.matched[0].partner)
    pairs = m.as_pq(c.first, c.second)
    local = {
        "least": float(similar.min()),
        "most": float(similar.max()),
        "neighbours": p.neighbours,
        "fewest": p.fewest_neighbours,
        "cosine": p.neighbour_cosine,
        "rejected": bool(method.rejected(*m.prints, p)),
    }
    styles = [
        {"color": draw.KEPT if is_kept else draw.LEFT, "linestyle": "-" if is_kept else "--"}
        | {"linewidth": 0.6 + 6.0 * share, "zorder": 3 + is_kept}
        for is_kept, share in zip(kept, left, strict=True)
    ]
    of_p, of_q = (side.index[of].tolist() for side, of in zip(m.sides, pairs, strict=True))
    names = "p", "q", "similarity", "relaxed", "kept"
    rows = zip(of_p, of_q, similar.tolist(), c.relaxed.tolist(), kept.tolist(), strict=True)
    relaxed = {
        "matches": [dict(zip(names, row, strict=True)) for row in rows],
        "kept": int(kept.sum()),
        "left": float(left.max()),
        "strength": c.strength,
        "threshold": load_weights().model_of(*m.prints).relaxation_threshold,
        "rounds": p.relaxation_rounds,
        "inertia": p.inertia,
    }
    picture = draw.links(m.sides, pairs, styles)
    return [Step("local_matches", None, local), Step("relaxation", picture, relaxed)]


def _mesh(m: DefaultMethod, pairing: Pairing) -> Step:
    """Show the mesh of pairs in both prints."""
    mesh, both_paired = pairing.mesh[0], m.as_pq(*m.paired)
    inner = mesh.triangles[(mesh.triangles >= fixed.FRAME).all(axis=1)]
    edges = np.stack([inner, np.roll(inner, -1, axis=1)], axis=2).reshape(-1, 2)

    def both(*axes: Axes) -> None:
        vertices = m.as_pq(mesh.vertex, mesh.image)
        for ax, side, of, vertex in zip(axes, m.sides, both_paired, vertices, strict=True):
            draw.ground(ax, side, f"{len(of)} paired")
            draw.lines(ax, side.shown(vertex[edges]), draw.MARKS[side.letter])
            ax.plot(*side.shown(np.delete(side.z, of)).T, ".", color=draw.GREY)
            draw.dots(ax, side, side.z[of])
            draw.labels(ax, side.shown(side.z[of]))

    index = [side.index[of].tolist() for side, of in zip(m.sides, both_paired, strict=True)]
    numbers = {
        "pairs": [list(pair) for pair in zip(*index, strict=True)],
        "same": m.prints[0].key == m.prints[1].key,
    }
    return Step("mesh_of_pairs", draw.draw(2, both), numbers)


def _ring_steps(m: DefaultMethod, pairing: Pairing, chosen: int | None) -> list[Step]:
    """Show the ring of the chosen pair on the unit circle, and its weights."""
    if chosen is None:
        return [Step("unit_circle")]
    mesh, predicted, *_ = pairing.mesh
    (i, j), places = (int(of[chosen]) for of in m.paired), pairing.places
    alone = replace(mesh, owner=np.append(mesh.owner[: fixed.FRAME], i))
    agreement = measure(alone, places[1], pairing.partner, predicted, m.parameters)
    weights = ring_weights(mesh.vertex[mesh.rings[i, mesh.once(i)]] - places[0][i])
    circle = {"pair": chosen + 1, "agreement": agreement["places"]}
    off = float(abs(predicted[i] - places[1][j]))
    weighed = {"off": off, "agreement": agreement["weights"]}
    return draw.ring_steps(m.rings[chosen], int(m.swapped), weights, circle, weighed)


def _evidence(m: DefaultMethod, evidence: Evidence, pair: ComparedPair | None) -> Step:
    """Show what the score is made of: the sum, its weights and its bounds, then the report."""
    e, p = evidence._asdict(), m.parameters
    model = load_weights().model_of(*m.prints)
    features = features_of(model, e, p)
    middle, spread, weight, _ = model.standard
    adds = (features - middle) / spread * weight
    low, high = model.quantiles @ amount_terms(math.sqrt(e["fewest"] * e["common"] / 2), e["area"])
    decades = 2.0 + (e["total"] - low) / max(high - low, fixed.LEAST_SPREAD)
    unusual = e["ridges"] - p.usual_correlation
    bound = most_decades(e["pairs"], unusual, e["cells"])
    columns = FEATURES, features.tolist(), (weight / spread).tolist(), adds.tolist()
    v = None if pair is None else pair.verification
    reported = v and {"minus_log_fmr": -math.log(v.fmr), "score": v.score, "at": v.threshold}
    numbers = {
        **e,
        "features": list(zip(*columns, strict=True)),
        "impostors": [float(low), float(high)],
        "by_sum": fixed.LOG_10 * float(decades),
        "bound": fixed.LOG_10 * bound,
        "rejected": method.rejected(*m.prints, p) or None,
        "reported": reported,
    }
    return Step("evidence", None, numbers)
