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

from fpmatch.errors import MatcherError
from fpmatch.pointset.pairing import greedy_pairs
from fpmatch.pointset.point_match import PointMatch, rms_distance
from fpmatch.pointset.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class PointCase:
    """Hold the input of a matcher.

    Parameters
    ----------
    p, q : ndarray of float64, shape (m, 2) and (n, 2)
        The sets.
    tolerance : float
        The matching distance t, in the units of `q`.
    rho, lambda_ : float
        ρ and λ of the experiment.
    max_steps : int
        Bound of the work for a matcher that counts its steps.
    limit_s : float
        Seconds after which a matcher without a bound of its own is stopped.
    """

    p: NDArray[np.float64]
    q: NDArray[np.float64]
    tolerance: float
    rho: float
    lambda_: float
    max_steps: int
    limit_s: float


class StoppedError(BaseException):
    """A match took longer than its case allows, and was stopped without an answer.

    No `Exception`, so that it passes through packages that catch every one.
    """


@dataclass(frozen=True, slots=True)
class BenchMatcher:
    """Hold a matcher of the experiment.

    Parameters
    ----------
    name : str
        Its name in tables and files.
    find : callable
        Takes a `PointCase` and returns a `PointMatch`. Raises `StoppedError` where it was stopped.
    complete : bool
        Whether a full run has to try it on all pairs, however long that takes.
    """

    name: str
    find: Callable[[PointCase], PointMatch]
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
    >>> matcher_named("triangles").complete
    True
    """
    if name not in _MATCHERS:
        raise MatcherError(f"unknown matcher {name!r}: expected one of {', '.join(MATCHER_NAMES)}")
    if not is_installed(name):
        raise MatcherError(f"matcher {name} is not installed: pip install 'fpmatch[bench]'")
    return _MATCHERS[name]


def is_installed(name: str) -> bool:
    """Return whether the matcher of that name, one of `MATCHER_NAMES`, is installed."""
    return name != "astroalign" or find_spec("astroalign") is not None


def _triangles(case: PointCase) -> PointMatch:
    from fpmatch.pointset.match import match_points  # noqa: PLC0415

    return match_points(case.p, case.q, tolerance=case.tolerance)


def _paper(case: PointCase) -> PointMatch:
    from fpmatch.pointset.match import decided  # noqa: PLC0415
    from fpmatch.pointset.unit_circle.matcher import (  # noqa: PLC0415
        UnitCircleParameters,
        match_by_unit_circle,
    )

    given = UnitCircleParameters(tolerance=case.tolerance, matching_factor=case.rho)
    return decided(match_by_unit_circle(case.p, case.q, given), case.rho)


def _van_wamelen(case: PointCase) -> PointMatch:
    from fpmatch.pointset.van_wamelen.matcher import match_van_wamelen  # noqa: PLC0415

    return match_van_wamelen(
        *(case.p, case.q),
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
            found, _ = astroalign.find_transform(
                case.p, case.q, max_control_points=max(len(case.p), len(case.q))
            )
    except (astroalign.MaxIterError, *_ASTROALIGN_FAILURES):
        return PointMatch.none()
    finally:
        astroalign.PIXEL_TOL = usual_tolerance
    transform = _as_similarity(found.params)
    if transform is None:
        return PointMatch.none()
    moved = transform.apply(case.p)
    pairs = greedy_pairs(moved, case.q, case.tolerance)
    rms = rms_distance(moved[pairs[:, 0]], case.q[pairs[:, 1]])
    return PointMatch(transform, pairs, len(pairs) / min(len(case.p), len(case.q)), rms, 0)


_ASTROALIGN_FAILURES: Final = (ValueError, AttributeError)
"""Raised by astroalign where a transform loses all its triangles as it is refitted."""


_MATCHERS: Final = {
    matcher.name: matcher
    for matcher in (
        BenchMatcher("triangles", _triangles, complete=True),
        BenchMatcher("paper", _paper),
        BenchMatcher("van-wamelen", _van_wamelen),
        BenchMatcher("astroalign", _astroalign),
    )
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
