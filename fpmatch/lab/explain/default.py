"""What the default matcher computes on two prints, by the functions of the reference matcher."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fpmatch.lab.explain.shared import numbers_of
from fpmatch.lab.explain.steps import FRAME_NAME, Ring, Side
from fpmatch.matching import reference as method
from fpmatch.matching.constants.comparison import FRAME
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.pipeline.evidence import load_weights
from fpmatch.matching.reference.evidence import features_of
from fpmatch.matching.reference.neighbourhood import local_similarity
from fpmatch.matching.reference.pair_mesh import measure
from fpmatch.matching.reference.relaxation import relax
from fpmatch.pointset.paper.parametrize import ring_angles, ring_weights

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.explain.steps import Plane, Sides
    from fpmatch.matching.pipeline.evidence import Evidence
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.reference.alignment import Pairing
    from fpmatch.matching.reference.relaxation import Candidates
    from fpmatch.prints.pair import ComparedPair

    Numbers = NDArray[np.intp]
    Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PairedMesh:
    """The pairs that grew, their mesh, and the evidence in them: of A with B."""

    pairing: Pairing
    evidence: Evidence

    @property
    def vertex(self) -> Plane:
        """Vertices of the mesh in A: frame points, then paired minutiae."""
        return self.pairing.mesh[0].vertex

    @property
    def image(self) -> Plane:
        """The same in B."""
        return self.pairing.mesh[0].image

    @property
    def triangles(self) -> Numbers:
        """Triangles of the mesh, (T, 3)."""
        return self.pairing.mesh[0].triangles

    @property
    def predicted(self) -> Plane:
        """Places in B where the mesh predicts the minutiae of A."""
        return self.pairing.mesh[1]

    @cached_property
    def edges(self) -> Numbers:
        """Ends of the edges of the mesh, (E, 2)."""
        corners = self.triangles, np.roll(self.triangles, -1, axis=1)
        ends = np.stack(corners, axis=2).reshape(-1, 2)
        return np.unique(np.sort(ends, axis=1), axis=0)


class RingMeasures(NamedTuple):
    """What the matcher measures on the ring of a pair; lengths in px at 500 dpi."""

    weights: list[float]  # eq. (4), of A's minutia in its ring
    spread: float  # standard deviation of the places' differences, in radians
    off: float  # distance of the partner from its prediction
    place_agreement: float  # 0 to 1
    weight_agreement: float  # 0 to 1


@dataclass(frozen=True, eq=False)
class DefaultMethod:
    """The steps on two prints: A is the first of them in the order of content."""

    pair: ComparedPair
    sides: Sides
    prints: tuple[PreparedTemplate, PreparedTemplate]  # A, B
    swapped: bool  # whether A is Q
    candidates: Candidates
    matched: PairedMesh | None
    parameters: MatchParameters

    @classmethod
    def of(cls, pair: ComparedPair, parameters: MatchParameters = USUAL) -> DefaultMethod:
        """Take the steps of the reference matcher on two prints that were compared."""
        given = pair.probe, pair.reference
        p, q = (method.prepare(one.template, parameters) for one in given)
        sides = Side.of_prepared("P", given[0], p), Side.of_prepared("Q", given[1], q)
        swapped = q.key < p.key
        a, b = (q, p) if swapped else (p, q)
        similarity = local_similarity(a.neighbourhoods, b.neighbourhoods, parameters)
        matched = method.match(a, b, parameters) if min(len(a), len(b)) else None
        mesh = None if matched is None else PairedMesh(matched[0], matched[1].evidence)
        candidates = relax(a.points, b.points, similarity, parameters)
        return cls(pair, sides, (a, b), swapped, candidates, mesh, parameters)

    @property
    def ordered(self) -> Sides:
        """The sides of A and B."""
        first, second = self.sides
        return (second, first) if self.swapped else (first, second)

    def as_pq(self, of_a: Any, of_b: Any) -> tuple[Any, Any]:
        """Return what A and B have as P and Q have it."""
        return (of_b, of_a) if self.swapped else (of_a, of_b)

    @cached_property
    def kept(self) -> NDArray[np.bool_]:
        """Which local matches relaxation keeps: those from which the first hypothesis starts."""
        c = self.candidates
        if not c.seeds:
            return np.zeros(len(c.first), bool)
        return c.among(c.hypothesis(len(self.prints[0]), c.seeds[0])[0])

    @cached_property
    def paired(self) -> tuple[Numbers, Numbers]:
        """Minutiae of A and B that are paired, in the order of P."""
        if self.matched is None:
            return np.empty(0, np.intp), np.empty(0, np.intp)
        partner = self.matched.pairing.partner
        i = np.flatnonzero(partner >= 0)
        order = np.argsort(partner[i] if self.swapped else i, kind="stable")
        return i[order], partner[i][order]

    @cached_property
    def rings(self) -> list[Ring | None]:
        """The ring of each pair in the mesh of pairs."""
        mesh = self.matched
        if mesh is None:
            return []
        return [self._ring(mesh, int(i), int(j)) for i, j in zip(*self.paired, strict=True)]

    def _ring(self, mesh: PairedMesh, i: int, j: int) -> Ring | None:
        whole, (a, b) = mesh.pairing.mesh[0], mesh.pairing.places
        ring = whole.rings[i, whole.once(i)]
        if not len(ring):
            return None
        owner = whole.owner[ring]
        names = [
            [FRAME_NAME if k < 0 else str(n) for k, n in zip(owner, side.index[of], strict=True)]
            for side, of in zip(self.ordered, (owner, mesh.pairing.partner[owner]), strict=True)
        ]
        angles = self.as_pq(*(ring_angles(of[ring]) for of in (mesh.vertex, mesh.image)))
        return Ring(
            sides=self.sides,
            centres=self.as_pq(complex(a[i]), complex(b[j])),
            points=self.as_pq(mesh.vertex[ring], mesh.image[ring]),
            names=self.as_pq(*names),
            edges=self.as_pq(mesh.vertex[mesh.edges], mesh.image[mesh.edges]),
            angles=angles,
            turn=float((angles[1] - angles[0]).mean()),
        )

    def measures(self, mesh: PairedMesh, chosen: int) -> RingMeasures:
        """Measure the ring of a pair as the matcher does."""
        (whole, predicted, *_), (a, b) = mesh.pairing.mesh, mesh.pairing.places
        i, j = (int(of[chosen]) for of in self.paired)
        ring = whole.rings[i, whole.once(i)]
        weights = ring_weights(mesh.vertex[ring] - a[i])
        apart = ring_angles(mesh.vertex[ring]) - ring_angles(mesh.image[ring])
        alone = replace(whole, owner=np.append(whole.owner[:FRAME], i))
        of_pair = measure(alone, b, mesh.pairing.partner, predicted, self.parameters)
        off = float(abs(predicted[i] - b[j]))
        agreements = of_pair["places"], of_pair["weights"]
        return RingMeasures(weights.tolist(), float(apart.std()), off, *agreements)

    def numbers(self, chosen: int | None) -> dict[str, Any]:
        """Return every number of the steps; minutiae are numbered as in the template."""
        c, (first, second) = self.candidates, self.ordered
        pq = self.as_pq(first.index[c.first], second.index[c.second])
        each = *pq, c.similarity[c.first, c.second], c.relaxed, self.kept
        fields = "p", "q", "similarity", "relaxed", "kept"
        numbers = {
            **numbers_of(self.sides),
            "first": first.letter.lower(),
            "similarity": (c.similarity.T if self.swapped else c.similarity).tolist(),
            "local_matches": rows(fields, *each),
            "support": c.support.tolist(),
            "pairs": [],
            "mesh_of_pairs": None,
            "ring": None,
            "predictions": None,
            "evidence": None,
        }
        mesh = self.matched
        if mesh is None:
            return numbers
        i, j = self.paired
        pq = self.as_pq(first.index[i], second.index[j])
        weight = mesh.pairing.weight[i]
        vertices = zip(self.sides, self.as_pq(mesh.vertex, mesh.image), strict=True)
        shown = {side.letter.lower(): side.given(of) for side, of in vertices}
        partner = mesh.pairing.partner
        partners = [None if k < 0 else int(second.index[k]) for k in partner]
        nearest = mesh.pairing.mesh[3].tolist()
        evidence = mesh.evidence._asdict()
        model = load_weights().model_of(*self.prints)
        features = features_of(model, evidence, self.parameters)
        numbers |= {
            "pairs": rows(("number", "p", "q", "weight"), np.arange(1, len(i) + 1), *pq, weight),
            "mesh_of_pairs": {"frame": FRAME, **shown, "triangles": mesh.triangles.tolist()},
            "predictions": [
                {"of": k, "at": at, "nearest_pair": near, "partner": other}
                for k, at, near, other in zip(
                    first.index.tolist(),
                    second.given(mesh.predicted),
                    nearest,
                    partners,
                    strict=True,
                )
            ],
            "evidence": evidence | {"features": features.tolist()},
        }
        ring = None if chosen is None else self.rings[chosen]
        if chosen is not None and ring is not None:
            measures = self.measures(mesh, chosen)._asdict()
            numbers["ring"] = {"pair": chosen + 1, **ring.numbers(), **measures}
        return numbers


def rows(names: tuple[str, ...], *columns: NDArray[Any]) -> list[dict[str, Any]]:
    """Return columns as the rows of a table for JSON."""
    values = zip(*(column.tolist() for column in columns), strict=True)
    return [dict(zip(names, row, strict=True)) for row in values]
