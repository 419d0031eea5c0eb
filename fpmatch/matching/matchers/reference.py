"""Matcher "reference": the default matcher by `fpmatch.matching.reference`, without kernels.

Its similarities are those of `unit_circle` to 1e-9; it is what to change and to measure.
"""

from __future__ import annotations

from typing import Final

from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher


class ReferenceMatcher(UnitCircleMatcher):
    """Compare prints as `UnitCircleMatcher` does where no kernels are compiled."""

    name = "reference"
    by_reference = True


MATCHER: Final = ReferenceMatcher()
