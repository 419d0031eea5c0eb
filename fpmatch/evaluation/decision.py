"""The calibration of a matcher, and the default outcomes of `fpmatch.verify` by similarities."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.calibration import calibrated_matchers, load_calibration
from fpmatch.matching.decision import decide, reachable_scores
from fpmatch.matching.matchers import get_matcher, matcher_names
from fpmatch.matching.result import DecidesByShare
from fpmatch.matching.verify import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.matching.calibration import Calibration


def calibration_of(matcher: str) -> Calibration | None:
    """Return the package's own calibration of a matcher; None where there is none."""
    return load_calibration(matcher) if matcher in calibrated_matchers() else None


def outcomes(
    matcher: str, similarities: NDArray[np.float64], reachable: NDArray[np.float64]
) -> NDArray[np.str_]:
    """Return the outcomes of comparisons by their similarities and the reachable ones.

    A print without a template, whose reachable similarity is minus infinity, is inconclusive. A
    matcher that neither decides by itself nor is calibrated has no outcomes: they are "".
    """
    if rho_of(matcher) is None and calibration_of(matcher) is None:
        return np.full(similarities.shape, "")
    scores = reachable_scores(calibration_of(matcher), reachable)
    return decide(matches(matcher, similarities), scores, DEFAULT_THRESHOLD)


def matches(matcher: str, similarities: ArrayLike) -> NDArray[np.bool_]:
    """Return which similarities are matches, as `fpmatch.verify` decides by default.

    A matcher that neither decides by itself nor is calibrated finds no match.
    """
    similarity = np.asarray(similarities, np.float64)
    rho = rho_of(matcher)
    if rho is not None:
        return np.asarray(similarity > rho)
    calibration = calibration_of(matcher)
    if calibration is None:
        return np.zeros(similarity.shape, bool)
    return np.asarray(calibration.scores(similarity) >= DEFAULT_THRESHOLD)


def rho_of(matcher: str) -> float | None:
    """Return the share of minutiae by which a matcher decides; None where the score does."""
    if matcher not in matcher_names():
        return None
    chosen = get_matcher(matcher)
    return chosen.rho if isinstance(chosen, DecidesByShare) else None
