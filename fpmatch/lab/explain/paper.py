"""What the paper's matcher computes on two point sets, or on the positions of minutiae."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.lab.explain.shared import numbers_of
from fpmatch.lab.explain.steps import Ring, Side
from fpmatch.pointset.geometry.point_match import check_rho
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.pointset.paper.matcher import fit_rings, match_prepared, similar_rings
from fpmatch.pointset.paper.one_rings import prepare_points

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from fpmatch.lab.explain.steps import Sides
    from fpmatch.matching.matchers.paper import PaperMatcher
    from fpmatch.pointset.geometry.point_match import PointMatch
    from fpmatch.pointset.paper.matcher import UnitCircleParameters
    from fpmatch.pointset.paper.one_rings import PreparedPoints
    from fpmatch.prints.pair import ComparedPair

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

MOST_POINTS: Final = 1000  # of a set that is drawn


class Circle(NamedTuple):
    """A closed one-ring of d points on its unit circle, as the matcher has it."""

    vertex: Ints  # (d,)
    angles: Floats  # (d,): eq. (3), in radians
    weights: Floats  # (d,): eq. (4)
    image: complex  # of the centre
    area: float  # of the polygon

    @classmethod
    def of(cls, prepared: PreparedPoints, i: int) -> Circle | None:
        """Return the circle of point i; None where its ring is not closed."""
        rings = prepared.rings
        for n in np.flatnonzero(rings.centre == i).tolist():
            part = slice(int(rings.start[n]), int(rings.start[n + 1]))
            x, y = rings.circle[:, part]
            angles = np.arctan2(y, x) % (2 * np.pi)
            image, area = complex(*rings.image[:, n]), float(rings.area[n])
            return cls(rings.vertex[part], angles, rings.weight[part], image, area)
        return None


@dataclass(frozen=True, eq=False)
class PaperMethod:
    """The steps on two sets; they match where more than a share ρ of the smaller is paired."""

    sides: Sides
    prepared: tuple[PreparedPoints, PreparedPoints]
    parameters: UnitCircleParameters
    rho: float

    @classmethod
    def of_prints(cls, pair: ComparedPair, matcher: PaperMatcher) -> PaperMethod:
        """Take the steps on the positions of minutiae, at 500 dpi."""
        given = pair.probe, pair.reference
        p, q = (matcher.prepare(one.template).at_500_dpi for one in given)
        probe, reference = given
        sides = (
            Side.of_points("P", probe.name, p, probe),
            Side.of_points("Q", reference.name, q, reference),
        )
        return cls(sides, (p, q), matcher.parameters, matcher.parameters.rho)

    @classmethod
    def of_sets(
        cls, sets: Iterable[tuple[str, Floats]], parameters: UnitCircleParameters, rho: float
    ) -> PaperMethod:
        """Take the steps on two sets, each with its name; raises PointSetError."""
        check_rho(rho)
        (p_name, p), (q_name, q) = ((name, _prepared(name, points)) for name, points in sets)
        sides = Side.of_points("P", p_name, p), Side.of_points("Q", q_name, q)
        return cls(sides, (p, q), parameters, rho)

    @cached_property
    def match(self) -> PointMatch:
        """The best transform and its pairs, whatever their share."""
        return match_prepared(*self.prepared, self.parameters)

    @property
    def matches(self) -> bool:
        """Whether the share that is paired exceeds ρ."""
        return self.match.matched_share > self.rho

    @cached_property
    def local(self) -> Ints:
        """Local matches, (K, 2): similar rings, by their places among the rings."""
        p, q = self.prepared
        return similar_rings(p.rings, q.rings, self.parameters.area_tolerance)

    @property
    def centres(self) -> tuple[Ints, Ints]:
        """The points of P and Q whose rings match locally."""
        p, q = self.prepared
        return p.rings.centre[self.local[:, 0]], q.rings.centre[self.local[:, 1]]

    @property
    def tolerance(self) -> float:
        """The matching distance of eq. (2), in the units shown of the larger set."""
        larger = int(len(self.prepared[1]) >= len(self.prepared[0]))
        q = self.prepared[larger]
        own = math.ldexp(self.parameters.precision * q.spacing, q.frame.exponent)
        return own * self.sides[larger].unit

    def circles(self, pair: int) -> tuple[Circle, Circle] | None:
        """Return the circles of a pair, if both are closed and have as many points."""
        i, j = self.match.pairs[pair].tolist()
        p, q = Circle.of(self.prepared[0], i), Circle.of(self.prepared[1], j)
        if p is None or q is None or len(p.vertex) != len(q.vertex):
            return None
        return p, q

    @cached_property
    def rings(self) -> list[Ring | None]:
        """The ring of each pair, its points in the cyclic order in which the circles agree best."""
        return [self._ring(pair) for pair in range(len(self.match.pairs))]

    def _ring(self, pair: int) -> Ring | None:
        circles = self.circles(pair)
        if circles is None:
            return None
        a, b = circles
        shift, turn = best_turn(a, b)
        first, second = self.sides
        vertex = a.vertex, np.roll(b.vertex, -shift)
        i, j = self.match.pairs[pair].tolist()
        return Ring(
            sides=self.sides,
            centres=(complex(first.z[i]), complex(second.z[j])),
            points=(first.z[vertex[0]], second.z[vertex[1]]),
            names=(list(map(str, vertex[0])), list(map(str, vertex[1]))),
            edges=(first.edges, second.edges),
            angles=(a.angles, np.roll(b.angles, -shift)),
            turn=turn,
        )

    def agreement(self, ring: Ring | None) -> float:
        """Return how many points of a ring in P have their partners in that in Q, as a share."""
        if ring is None:
            return 0.0
        partner = {str(i): str(j) for i, j in self.match.pairs.tolist()}
        return float(np.mean([partner.get(a) == b for a, b in zip(*ring.names, strict=True)]))

    def numbers(self, chosen: int | None) -> dict[str, Any]:
        """Return every number of the steps, the scale of transforms in the units of the files."""
        (p, q), (first, second) = self.prepared, self.sides
        per_unit = math.ldexp(second.unit / first.unit, q.frame.exponent - p.frame.exponent)
        moves = fit_rings(p, q, self.local)
        local = zip(*self.centres, *self.local.T, moves, strict=True)
        numbers = {
            **numbers_of(self.sides),
            "area_tolerance": self.parameters.area_tolerance,
            "tolerance": self.tolerance,
            "rho": self.rho,
            "local_matches": [
                {
                    "p": int(i),
                    "q": int(j),
                    "areas": [float(p.rings.area[k]), float(q.rings.area[n])],
                    "scale": math.hypot(c, s) * per_unit,
                    "rotation_deg": math.degrees(math.atan2(s, c)),
                }
                for i, j, k, n, (c, s, _, _) in local
            ],
            "pairs": [
                {"number": n, "p": i, "q": j}
                for n, (i, j) in enumerate(self.match.pairs.tolist(), start=1)
            ],
            "match": self.matches,
            "matched_share": self.match.matched_share,
            "rms": self.match.rms * second.unit,
            "transform": None,
            "ring": None,
        }
        if isinstance(t := self.match.transform, Similarity):
            scale = t.scale * second.unit / first.unit
            shift = {"tx": t.tx * second.unit, "ty": t.ty * second.unit}
            numbers["transform"] = {"scale": scale, "rotation_deg": t.rotation_deg, **shift}
        ring = None if chosen is None else self.rings[chosen]
        if chosen is not None and ring is not None and (both := self.circles(chosen)):
            numbers["ring"] = {
                "pair": chosen + 1,
                **ring.numbers(),
                "weights": both[0].weights.tolist(),
                "images": [[of.image.real, of.image.imag] for of in both],
                "areas": [of.area for of in both],
            }
        return numbers


def _prepared(name: str, points: Floats) -> PreparedPoints:
    """Prepare a set, or refuse one that cannot be drawn."""
    if not 1 <= len(points) <= MOST_POINTS:
        raise PointSetError(f"{name}: {len(points)} points, but 1 to {MOST_POINTS} are drawn")
    try:
        return prepare_points(points)
    except PointSetError as error:
        raise PointSetError(f"{name}: {str(error).removeprefix('points: ')}") from error


def best_turn(a: Circle, b: Circle) -> tuple[int, float]:
    """Return the cyclic shift and the rotation in radians at which two circles agree best.

    As in the matcher, the correlation of boundary points and centres' images is largest, the image
    counting as much as the whole boundary.
    """
    d = len(a.angles)
    images = d * a.image.conjugate() * b.image
    from_a, onto_b = np.exp(-1j * a.angles), np.exp(1j * b.angles)
    agreement = [images + from_a @ np.roll(onto_b, -shift) for shift in range(d)]
    shift = int(np.abs(agreement).argmax())
    return shift, float(np.angle(agreement[shift]))
