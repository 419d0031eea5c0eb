"""The matchers that the experiment on random point sets compares, behind one interface.

A matcher is given a case, which holds both sets and what may be known of them, and returns a match
with or without a transform. All are given the same matching distance t:

- "triangles": the default matcher of `match_points`.
- "paper": the paper's method, with the paper's rule that more than a share ρ of P's points match.
- "van-wamelen": the paper's baseline, given the true ρ and λ, which matches where it pairs ⌈ρm⌉
  points. It gives up, without a match, after as many steps as the case allows.
- "astroalign": the Python package of that name, its own pixel tolerance set to t. Its pairs are
  corners of a few triangles; in its favour, all points within t under its transform are paired one
  to one instead. It is random without a seed, its search has no bound, and a call is stopped after
  as many seconds as the case allows (where the system has timers, in the main thread). It counts
  only where it is installed.
"""

from __future__ import annotations

import math
import signal
import threading
import warnings
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import MatcherError, unknown_name
from fpmatch.pointset.geometry.pairing import greedy_pairs
from fpmatch.pointset.geometry.point_match import PointMatch, rms_distance
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class PointCase:
    """The input of a matcher."""

    p: NDArray[np.float64]  # shape (m, 2)
    q: NDArray[np.float64]  # shape (n, 2)
    tolerance: float  # the matching distance t, in the units of `q`
    rho: float
    lambda_: float
    max_steps: int  # bound of the work for a matcher that counts its steps
    limit_s: float  # seconds after which a matcher without a bound of its own is stopped


class StoppedError(BaseException):
    """A match took longer than its case allows, and was stopped without an answer.

    No `Exception`, so that it passes through packages that catch every one.
    """


@dataclass(frozen=True, slots=True)
class BenchMatcher:
    """A matcher by its name in tables and files; `find` raises `StoppedError` if stopped."""

    name: str
    find: Callable[[PointCase], PointMatch]
    complete: bool = False  # whether a full run has to try it on all pairs, however long that takes


def matcher_named(name: str) -> BenchMatcher:
    """Return the matcher of that name; MatcherError if there is none or it is not installed."""
    if name not in _MATCHERS:
        raise MatcherError(unknown_name("matcher", name, MATCHER_NAMES))
    if not is_installed(name):
        raise MatcherError(f"matcher {name} is not installed: pip install 'fpmatch[bench]'")
    return _MATCHERS[name]


def is_installed(name: str) -> bool:
    """Return whether the matcher of that name, one of `MATCHER_NAMES`, is installed."""
    return name != "astroalign" or find_spec("astroalign") is not None


def _triangles(case: PointCase) -> PointMatch:
    from fpmatch.lab.points.match import match_points  # noqa: PLC0415

    return match_points(case.p, case.q, tolerance=case.tolerance)


def _paper(case: PointCase) -> PointMatch:
    from fpmatch.lab.points.match import decided  # noqa: PLC0415
    from fpmatch.pointset.paper.matcher import (  # noqa: PLC0415
        UnitCircleParameters,
        match_by_unit_circle,
    )

    given = UnitCircleParameters(tolerance=case.tolerance, matching_factor=case.rho)
    return decided(match_by_unit_circle(case.p, case.q, given), case.rho)


def _van_wamelen(case: PointCase) -> PointMatch:
    from fpmatch.lab.points.van_wamelen.matcher import match_van_wamelen  # noqa: PLC0415

    return match_van_wamelen(
        case.p,
        case.q,
        rho=case.rho,
        lambda_=case.lambda_,
        tolerance=case.tolerance,
        max_steps=case.max_steps,
    )


def _astroalign(case: PointCase) -> PointMatch:
    import astroalign  # noqa: PLC0415

    usual_tolerance = astroalign.PIXEL_TOL
    astroalign.PIXEL_TOL = case.tolerance
    try:
        with _time_limit(case.limit_s), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it calls functions that its own libraries deprecate
            most = max(len(case.p), len(case.q))
            estimated, _ = astroalign.find_transform(case.p, case.q, max_control_points=most)
    except (astroalign.MaxIterError, ValueError, AttributeError):
        # The last two are raised where a transform loses all its triangles as it is refitted.
        return PointMatch.none()
    finally:
        astroalign.PIXEL_TOL = usual_tolerance
    transform = _as_similarity(estimated.params)
    if transform is None:
        return PointMatch.none()
    moved = transform.apply(case.p)
    pairs = greedy_pairs(moved, case.q, case.tolerance)
    rms = rms_distance(moved[pairs[:, 0]], case.q[pairs[:, 1]])
    return PointMatch(transform, pairs, len(pairs) / min(len(case.p), len(case.q)), rms, 0)


_MATCHERS: Final = {
    "triangles": BenchMatcher("triangles", _triangles, complete=True),
    "paper": BenchMatcher("paper", _paper),
    "van-wamelen": BenchMatcher("van-wamelen", _van_wamelen),
    "astroalign": BenchMatcher("astroalign", _astroalign),
}
MATCHER_NAMES: Final = tuple(_MATCHERS)


def _as_similarity(matrix: NDArray[np.float64]) -> Similarity | None:
    """Return the similarity of a 3 x 3 matrix; None where it collapses or is not finite."""
    (a, _, tx), (b, _, ty) = matrix[:2].tolist()
    valid = all(map(math.isfinite, (a, b, tx, ty))) and math.hypot(a, b) > 0
    return Similarity.of_move((a, b, tx, ty)) if valid else None


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise `StoppedError` in the block after so many seconds, where the system has timers."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not (hasattr(signal, "setitimer") and in_main_thread and math.isfinite(seconds)):
        yield
        return

    def time_up(*_: Any) -> None:
        raise StoppedError

    usual_handler = signal.signal(signal.SIGALRM, time_up)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, usual_handler)
