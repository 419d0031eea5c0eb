"""The package's own calibration of a matcher."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fpmatch.matching.calibration import is_calibrated, load_calibration

if TYPE_CHECKING:
    from fpmatch.matching.calibration import Calibration


def calibration_of(matcher: str) -> Calibration | None:
    """Return the package's own calibration of a matcher; None where there is none."""
    return load_calibration(matcher) if is_calibrated(matcher) else None
