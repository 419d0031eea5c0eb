"""The default decisions of `fpmatch.verify` on comparisons that were made before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.calibration import calibrated_matchers, load_calibration
from fpmatch.matching.matchers import get_matcher, matcher_names
from fpmatch.matching.result import DecidesByShare
from fpmatch.matching.verify import DEFAULT_THRESHOLD

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def decide(matcher: str, similarities: ArrayLike) -> NDArray[np.bool_]:
    """Decide which similarities are matches, as `fpmatch.verify` does by default.

    A matcher that neither decides by itself nor is calibrated finds no match.

    Examples
    --------
    >>> decide("paper", [0.6, 0.61]).tolist()
    [False, True]
    """
    similarity = np.asarray(similarities, np.float64)
    rho = rho_of(matcher)
    if rho is not None:
        return np.asarray(similarity > rho)
    if matcher in calibrated_matchers():
        return np.asarray(load_calibration(matcher).scores(similarity) >= DEFAULT_THRESHOLD)
    return np.zeros(similarity.shape, bool)


def rho_of(matcher: str) -> float | None:
    """Return the share of minutiae by which a matcher decides; None where the score does.

    Examples
    --------
    >>> rho_of("paper"), rho_of("unit-circle")
    (0.6, None)
    """
    if matcher not in matcher_names():
        return None
    chosen = get_matcher(matcher)
    return chosen.rho if isinstance(chosen, DecidesByShare) else None
