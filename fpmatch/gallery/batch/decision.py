"""The calibration of a matcher, and which similarities are matches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import is_calibrated, load_calibration
from fpmatch.matching.decision import DEFAULT_THRESHOLD
from fpmatch.matching.registry import get_matcher, matcher_names, split_name

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.matching.calibration import Calibration


def calibration_of(matcher: str) -> Calibration | None:
    """Return the package's own calibration of a matcher; None where there is none."""
    return load_calibration(matcher) if is_calibrated(matcher) else None


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
    if split_name(matcher)[0] not in matcher_names():
        return None
    try:
        chosen = get_matcher(matcher)
    except MatcherError:  # of a file of scores: parameters that this version does not have
        return None
    return chosen.rho
