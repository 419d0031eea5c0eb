"""The matchers that the experiment on random point sets compares, behind one interface.

A matcher is given a case, which holds both sets and what may be known of them, and returns a match
with or without a transform. All are given the same matching distance t:

- "triangles": the default matcher of `match_points`.
- "paper": the paper's method, with the paper's rule that more than a share ρ of P's points match.
- "van-wamelen": the paper's baseline, given the true ρ and λ, which matches where it pairs ⌈ρm⌉
  points. It gives up, without a match, after as many steps as the case allows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from fpmatch.lab.points.match import match_points
from fpmatch.lab.points.van_wamelen.matcher import match_van_wamelen
from fpmatch.pointset.paper.matcher import UnitCircleParameters, decided, match_by_unit_circle

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.pointset.geometry.point_match import PointMatch


@dataclass(frozen=True, slots=True, eq=False)
class PointCase:
    """The input of a matcher."""

    p: NDArray[np.float64]  # shape (m, 2)
    q: NDArray[np.float64]  # shape (n, 2)
    tolerance: float  # the matching distance t, in the units of `q`
    rho: float
    lambda_: float
    max_steps: int  # bound of the work for a matcher that counts its steps


def _triangles(case: PointCase) -> PointMatch:
    return match_points(case.p, case.q, tolerance=case.tolerance)


def _paper(case: PointCase) -> PointMatch:
    given = UnitCircleParameters(tolerance=case.tolerance, matching_factor=case.rho)
    return decided(match_by_unit_circle(case.p, case.q, given), case.rho)


def _van_wamelen(case: PointCase) -> PointMatch:
    return match_van_wamelen(
        case.p,
        case.q,
        rho=case.rho,
        lambda_=case.lambda_,
        tolerance=case.tolerance,
        max_steps=case.max_steps,
    )


MATCHERS: Final[Mapping[str, Callable[[PointCase], PointMatch]]] = {
    "triangles": _triangles,
    "paper": _paper,
    "van-wamelen": _van_wamelen,
}
"""The matchers by their names in tables and files."""
