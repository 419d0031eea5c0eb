"""The matchers that the experiment on random point sets compares, behind one interface.

A matcher is given a case, which holds both sets and what may be known of them, and claims a match
or none. All are given the same matching distance t. What each counts as a match:

- "ours": what `match_points` finds by default, where it finds something better than chance.
- "paper": the paper's method claims a match by the paper's own rule, where the number of points
  that match is higher than ρ: where more than a share ρ of P's points are paired one to one.
- "van-wamelen": the baseline, told the true ρ and λ, claims a match where it pairs ⌈ρm⌉ points.
  It gives up, without a match, after as many looks as the case grants.
- "astroalign": the Python package of that name, whose own pixel tolerance is set to t. Its
  pairs are few triangles' corners; here all points within t under its transform are paired one to
  one instead, which is generous to it. It draws lots that no seed controls, its search has no
  bound, and a call is stopped after as many seconds as the case grants (where the system has
  timers and the call is made in the main thread). It counts only where it is installed.
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

from fpmatch.errors import MatcherError
from fpmatch.pointset.pairing import greedy_pairs
from fpmatch.pointset.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.pointset.point_match import PointMatch


@dataclass(frozen=True, slots=True, eq=False)
class PointCase:
    """Hold what a matcher is given.

    Parameters
    ----------
    p, q : ndarray of float64, shape (m, 2) and (n, 2)
        The sets.
    tolerance : float
        The matching distance t, in the units of `q`.
    rho, lambda_ : float
        ρ and λ of the experiment, for matchers that ask for them.
    max_steps : int
        Bound of the work for a matcher that counts what it looks at.
    limit_s : float
        Seconds after which a matcher that has no bound of its own is stopped.
    """

    p: NDArray[np.float64]
    q: NDArray[np.float64]
    tolerance: float
    rho: float
    lambda_: float
    max_steps: int
    limit_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Claim:
    """Hold a match that a matcher claims.

    Parameters
    ----------
    transform : Similarity
        Maps P onto Q.
    pairs : ndarray of int32, shape (K, 2)
        Indices (into P, into Q), one to one.
    """

    transform: Similarity
    pairs: NDArray[np.int32]


class StoppedError(BaseException):
    """A match took longer than its case grants, and was stopped without an answer.

    No `Exception`, so that it passes through packages that catch every one.
    """


@dataclass(frozen=True, slots=True)
class BenchMatcher:
    """Hold a matcher of the experiment.

    Parameters
    ----------
    name : str
        What tables and files call it.
    find : callable
        Takes a `PointCase` and returns a `Claim`, or None where it claims no match. Raises
        `StoppedError` where it was stopped.
    complete : bool
        Whether a full run has to try it on all pairs, however long that takes.
    """

    name: str
    find: Callable[[PointCase], Claim | None]
    complete: bool = False


def matcher_named(name: str) -> BenchMatcher:
    """Return the matcher of that name.

    Parameters
    ----------
    name : str
        One of `MATCHER_NAMES`.

    Returns
    -------
    BenchMatcher
        The matcher.

    Raises
    ------
    MatcherError
        If there is none of that name, or it is not installed.

    Examples
    --------
    >>> matcher_named("ours").complete
    True
    """
    if name not in _MATCHERS:
        raise MatcherError(f"unknown matcher {name!r}: expected one of {', '.join(MATCHER_NAMES)}")
    if not is_installed(name):
        raise MatcherError(f"matcher {name} is not installed: pip install 'fpmatch[bench]'")
    return _MATCHERS[name]


def is_installed(name: str) -> bool:
    """Tell whether the matcher of that name, one of `MATCHER_NAMES`, can run here."""
    return name != "astroalign" or find_spec("astroalign") is not None


def _ours(case: PointCase) -> Claim | None:
    from fpmatch.pointset.match import match_points  # noqa: PLC0415

    return _claim(match_points(case.p, case.q, tolerance=case.tolerance))


def _paper(case: PointCase) -> Claim | None:
    from fpmatch.pointset.unit_circle.matcher import (  # noqa: PLC0415
        UnitCircleParameters,
        match_by_unit_circle,
    )

    given = UnitCircleParameters(tolerance=case.tolerance, matching_factor=case.rho)
    match = match_by_unit_circle(case.p, case.q, given)
    return _claim(match) if match.matched_share > case.rho else None


def _van_wamelen(case: PointCase) -> Claim | None:
    from fpmatch.pointset.van_wamelen.matcher import match_van_wamelen  # noqa: PLC0415

    match = match_van_wamelen(
        case.p,
        case.q,
        rho=case.rho,
        lambda_=case.lambda_,
        tolerance=case.tolerance,
        max_steps=case.max_steps,
    )
    return _claim(match)


def _astroalign(case: PointCase) -> Claim | None:
    import astroalign  # noqa: PLC0415

    usual_tolerance = astroalign.PIXEL_TOL
    astroalign.PIXEL_TOL = case.tolerance
    try:
        with _time_limit(case.limit_s), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it calls names that its own libraries deprecate
            found, _ = astroalign.find_transform(
                case.p, case.q, max_control_points=max(len(case.p), len(case.q))
            )
    except (astroalign.MaxIterError, *_ASTROALIGN_FAILURES):
        return None
    finally:
        astroalign.PIXEL_TOL = usual_tolerance
    transform = _as_similarity(found.params)
    if transform is None:
        return None
    return Claim(transform, greedy_pairs(transform.apply(case.p), case.q, case.tolerance))


_ASTROALIGN_FAILURES: Final = (ValueError, AttributeError)
"""What it raises where a transform loses all its triangles as it is refitted."""


_MATCHERS: Final = {
    matcher.name: matcher
    for matcher in (
        BenchMatcher("ours", _ours, complete=True),
        BenchMatcher("paper", _paper),
        BenchMatcher("van-wamelen", _van_wamelen),
        BenchMatcher("astroalign", _astroalign),
    )
}
MATCHER_NAMES: Final = tuple(_MATCHERS)


def _claim(match: PointMatch) -> Claim | None:
    return None if match.transform is None else Claim(match.transform, match.pairs)


def _as_similarity(matrix: NDArray[np.float64]) -> Similarity | None:
    """Return a 3 x 3 matrix of a similarity as one; None where it is none."""
    (a, _, tx), (b, _, ty) = matrix[:2].tolist()
    scale = math.hypot(a, b)
    if not (all(map(math.isfinite, (a, b, tx, ty))) and scale > 0):
        return None
    return Similarity(scale, math.atan2(b, a), tx, ty)


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise `StoppedError` in the block after so many seconds, where timers can be had."""
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
