"""The calibration of a matcher, and the default outcomes of `fpmatch.verify` by similarities."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.calibration import is_calibrated, load_calibration
from fpmatch.matching.decision import DEFAULT_THRESHOLD, reachable_scores
from fpmatch.matching.result import INCONCLUSIVE, MATCH, NO_MATCH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration


def calibration_of(matcher: str) -> Calibration | None:
    """Return the package's own calibration of a matcher; None where there is none."""
    return load_calibration(matcher) if is_calibrated(matcher) else None


def outcomes(
    similarity: NDArray[np.float64],
    score: NDArray[np.float64],
    reachable: NDArray[np.float64],
    *,
    calibration: Calibration | None,
    rho: float | None,
    threshold: float = DEFAULT_THRESHOLD,
) -> NDArray[np.str_]:
    """Return the outcomes of comparisons by their scores or, where `rho` decides, similarities.

    `reachable` are the similarities that genuine prints reach. A print without a template, which
    has none, is inconclusive. Where neither a calibration nor `rho` decides, the outcomes are "".
    """
    if rho is None and calibration is None:
        return np.full(similarity.shape, "")
    matched = score >= threshold if rho is None else similarity > rho
    lowest = np.where(np.isnan(reachable), -np.inf, reachable)
    lacking = reachable_scores(calibration, lowest) < threshold
    return np.where(matched, MATCH, np.where(lacking, INCONCLUSIVE, NO_MATCH))
