"""The steps of the paper's matcher on two point sets, or on the positions of minutiae."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.lab.explain import pictures as draw
from fpmatch.lab.explain.pictures import Ring, Side, Step, clearest
from fpmatch.pointset.paper.matcher import match_prepared, similar_rings
from fpmatch.pointset.paper.one_rings import prepare_points
from fpmatch.pointset.paper.parametrize import parametrize

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.explain.pictures import Letter, Sides
    from fpmatch.matching.matchers.paper import PaperMatcher
    from fpmatch.pointset.geometry.point_match import PointMatch
    from fpmatch.pointset.paper.matcher import UnitCircleParameters
    from fpmatch.pointset.paper.one_rings import PreparedPoints
    from fpmatch.pointset.paper.parametrize import UnitCircle
    from fpmatch.prints.reading import GivenPrint

    Named = tuple[str, NDArray[np.float64]]

MOST_POINTS: Final = 1000  # of a set that is drawn
MOST_LINKS: Final = 300  # local matches drawn that are not pairs of the result


@dataclass(frozen=True, eq=False)
class PaperMethod:
    """The steps on two sets; they match where more than a share ρ of the smaller is paired."""

    sides: Sides
    prepared: tuple[PreparedPoints, PreparedPoints]
    parameters: UnitCircleParameters
    rho: float

    @classmethod
    def of_prints(
        cls, probe: GivenPrint, reference: GivenPrint, matcher: PaperMatcher
    ) -> PaperMethod:
        """Take the steps on the positions of minutiae, at 500 dpi."""
        p, q = (matcher.prepare(one.template)[0] for one in (probe, reference))
        sides = _side("P", probe.name, p, probe), _side("Q", reference.name, q, reference)
        return cls(sides, (p, q), matcher.parameters, matcher.parameters.rho)

    @classmethod
    def of_sets(
        cls, sets: tuple[Named, Named], parameters: UnitCircleParameters, rho: float
    ) -> PaperMethod:
        """Take the steps on two sets, each with its name; raises PointSetError."""
        for name, points in sets:
            if not 1 <= (count := len(points)) <= MOST_POINTS:
                raise PointSetError(f"{name}: {count} points, but 1 to {MOST_POINTS} are drawn")
        p, q = (prepare_points(points, name) for name, points in sets)
        sides = _side("P", sets[0][0], p), _side("Q", sets[1][0], q)
        return cls(sides, (p, q), parameters, rho)

    @cached_property
    def match(self) -> PointMatch:
        """The best transform and its pairs, whatever their share."""
        return match_prepared(*self.prepared, self.parameters)

    def circle(self, which: int, i: int) -> UnitCircle:
        """Return the closed ring of a point on its unit circle."""
        xy = self.prepared[which].points
        return parametrize(xy[self.sides[which].mesh.one_ring(i)], xy[i])

    @cached_property
    def rings(self) -> dict[int, Ring]:
        """The rings of pairs, by the places of those whose rings are closed and of one degree."""
        p, q = (set(prepared.rings.centre.tolist()) for prepared in self.prepared)
        first, second = (side.mesh.one_ring for side in self.sides)
        return {
            k: self._ring(i, j)
            for k, (i, j) in enumerate(self.match.pairs.tolist())
            if i in p and j in q and len(first(i)) == len(second(j))
        }

    def _ring(self, i: int, j: int) -> Ring:
        """Return a ring, its points in the cyclic order in which the circles agree best.

        As in the matcher, an image of the centre counts as much as the whole boundary.
        """
        a, b = self.circle(0, i), self.circle(1, j)
        images = len(a.angles) * complex(*a.image).conjugate() * complex(*b.image)
        from_a, onto_b = np.exp(-1j * a.angles), np.exp(1j * b.angles)
        agreement = [images + from_a @ np.roll(onto_b, -shift) for shift in range(len(onto_b))]
        shift = int(np.abs(agreement).argmax())
        first, second = self.sides
        vertex = first.mesh.one_ring(i), np.roll(second.mesh.one_ring(j), -shift)
        return Ring(
            sides=self.sides,
            centres=(complex(first.z[i]), complex(second.z[j])),
            points=(first.z[vertex[0]], second.z[vertex[1]]),
            names=(list(map(str, vertex[0])), list(map(str, vertex[1]))),
            edges=(first.z[first.mesh.edges], second.z[second.mesh.edges]),
            angles=(a.angles, np.roll(b.angles, -shift)),
            turn=float(np.angle(agreement[shift])),
        )


def _side(letter: Letter, name: str, of: PreparedPoints, given: GivenPrint | None = None) -> Side:
    return Side(letter, name, of.points.view(np.complex128).ravel(), np.arange(len(of)), given)


def explain_points(m: PaperMethod) -> list[Step]:
    """Return the steps of the paper's matcher."""
    pairs = {(str(i), str(j)) for i, j in m.match.pairs.tolist()}
    agreement = [0] * len(m.match.pairs)
    for k, ring in m.rings.items():
        agreement[k] = sum(both in pairs for both in zip(*ring.names, strict=True))
    chosen = clearest(m.rings, agreement)
    made = [draw.triangulation_step(m.sides)]
    if chosen is None:
        return [*made, Step("unit_circle"), _local(m), _global(m)]
    i, j = m.match.pairs[chosen].tolist()
    p, q = m.circle(0, i), m.circle(1, j)
    images = complex(*p.image), complex(*q.image)
    areas = {"areas": [p.area, q.area], "limit": m.parameters.area_tolerance}
    circle = {"pair": chosen + 1, "centre": [i, j], **areas}
    made += draw.ring_steps(m.rings[chosen], 0, p.weights, circle, {}, images)
    return [*made, _local(m), _global(m)]


def _local(m: PaperMethod) -> Step:
    """Show the rings that match locally, the pairs of the result on top."""
    p, q = (prepared.rings for prepared in m.prepared)
    limit = m.parameters.area_tolerance
    similar = similar_rings(p, q, limit)
    matches = np.column_stack([p.centre[similar[:, 0]], q.centre[similar[:, 1]]])
    pairs = set(map(tuple, m.match.pairs.tolist()))
    right = np.array([tuple(match) in pairs for match in matches.tolist()], bool)
    others = np.flatnonzero(~right)
    drawn = others[:: math.ceil(len(others) / MOST_LINKS) or 1]
    order = np.append(drawn, np.flatnonzero(right))
    faint, strong = {"color": draw.GREY, "alpha": 0.3}, {"color": draw.KEPT, "linewidth": 2.0}
    styles = [strong if k else faint for k in right[order]]
    picture = draw.links(m.sides, (matches[order, 0], matches[order, 1]), styles)
    numbers = {
        "rings": [len(p), len(q)], "limit": limit, "matches": matches.tolist(),
        "right": int(right.sum()), "drawn": len(drawn),
    }  # fmt: skip
    return Step("similar_rings", picture, numbers)


def _global(m: PaperMethod) -> Step:
    """Show P, moved by the best transform, over Q."""
    match, (p, q), t = m.match, m.sides, m.match.transform
    matches, pairs = match.matched_share > m.rho, match.pairs
    numbers: dict[str, Any] = {"match": matches, "rho": m.rho, "pairs": pairs.tolist()}
    if t is None:
        return Step("global_match", None, numbers)
    larger = int(len(m.prepared[1]) >= len(m.prepared[0]))
    own = m.parameters.precision * m.prepared[larger].spacing
    numbers |= {
        "matched_share": match.matched_share,
        "scale": t.scale * q.unit / p.unit,
        "rotation_deg": t.rotation_deg,
        "rms": match.rms * q.unit,
        "tolerance": math.ldexp(own, m.prepared[larger].frame.exponent) * m.sides[larger].unit,
        "precision": m.parameters.precision,
    }
    moved = t.apply(m.prepared[0].points).view(np.complex128).ravel()
    i, j = pairs.T
    return Step("global_match", draw.superposed(m.sides, moved, (i, j)), numbers)
