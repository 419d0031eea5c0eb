"""The scale between two prints: 1 where both resolutions are right.

A print of 569 dots per inch that is taken for 500 looks larger than it is, by 14 %. Two
impressions of one finger differ by 2 % in general, by 5 % rarely, and by 9 % hardly ever, where the
skin was stretched on purpose. Where paired minutiae differ more, a resolution is likely wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.plugins import call_matcher
from fpmatch.matching.calibration import allowance
from fpmatch.matching.result import compare_prepared
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI, MM_PER_INCH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.decision import Rule
    from fpmatch.matching.result import Side
    from fpmatch.templates.minutiae import Template

MIN_PAIRS: Final = 8  # below which no scale is measured
MAX_LOG_DIFFERENCE: Final = math.log1p(0.07)  # of scales that count as one
CANDIDATE_RATIOS: Final = (0.5, 0.63, 0.79, 0.89, 1.12, 1.26, 1.59, 2.0)  # where nothing matches
STANDARD_ERRORS: Final = 3.0  # that the ratio must lie beyond `MAX_LOG_DIFFERENCE`
_COMPLEX: Final = np.array([1, 1j])


@dataclass(frozen=True, slots=True)
class ScaleMeasurement:
    """The size of the reference relative to the probe, at the resolutions that they claim.

    `ratio` is that of lengths in millimetres, with its standard `error`; `differs` where it is
    certainly not 1.
    """

    ratio: float
    error: float
    differs: bool


def measure_scale(
    probe: Template, reference: Template, pairs: NDArray[np.integer]
) -> ScaleMeasurement | None:
    """Measure the scale by pairs of shape (K, 2); None where they are few, or all in one place."""
    if len(pairs) < MIN_PAIRS:
        return None
    a, b = (
        (xy - xy.mean(axis=0)) @ _COMPLEX * (MM_PER_INCH / one.dpi)
        for one, index in zip((probe, reference), pairs.T, strict=True)
        for xy in [one.minutiae.xy[index].astype(np.float64)]
    )
    spread_a, spread_b = float((np.abs(a) ** 2).sum()), float((np.abs(b) ** 2).sum())
    together = float(abs(np.vdot(a, b)))
    if not (spread_a > 0 and spread_b > 0 and together > 0):
        return None
    # Of the fits of B to A and of A to B, which noise shrinks alike, the one between them.
    ratio = math.sqrt(spread_b / spread_a)
    coherence = min(together / math.sqrt(spread_a * spread_b), 1.0)
    relative = math.sqrt((1 - coherence**2) / (2 * (len(pairs) - 2)))
    beyond = abs(math.log(ratio)) - STANDARD_ERRORS * relative
    return ScaleMeasurement(ratio, ratio * relative, differs=beyond > MAX_LOG_DIFFERENCE)


def find_scale(rule: Rule, probe: Side, reference: Side) -> ScaleMeasurement | None:
    """Find the scale at which two prints match that do not match as they are; None without any.

    It is a reason for the no, never a yes. Where a share of pairs decided, which no scale changes,
    none is tried.
    """
    if rule.rho is not None:
        return None
    dpi = probe[0].dpi
    ratios = [ratio for ratio in CANDIDATE_RATIOS if MIN_DPI <= dpi / ratio <= MAX_DPI]
    best, pairs = rule.threshold + allowance(1.0, len(CANDIDATE_RATIOS)), None  # of so many tries
    for ratio in call_matcher(rule.matcher, "possible_scales", probe[1], reference[1], ratios):
        scaled = call_matcher(rule.matcher, "prepare", replace(probe[0], dpi=dpi / ratio))
        # the reference, which is prepared for many comparisons, goes first: the score is the same
        comparison = compare_prepared(rule.matcher, reference[1], scaled)
        if (score := rule.score(comparison.similarity)) >= best:
            best, pairs = score, comparison.pairs[:, ::-1]
    measured = None if pairs is None else measure_scale(probe[0], reference[0], pairs)
    return measured if measured is not None and measured.differs else None
