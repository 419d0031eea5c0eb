"""The scale between two prints: 1 where both resolutions are right.

A print of 569 dots per inch that is taken for 500 looks larger than it is, by 14 %. Two
impressions of one finger differ by 2 % in general, by 5 % rarely, and by 9 % hardly ever, where the
skin was stretched on purpose. Where paired minutiae differ more, a resolution is likely wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.calibration import allowance, score_of
from fpmatch.matching.result import call_matcher, compare_prepared, prepare_print
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI, MM_PER_INCH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.result import Side
    from fpmatch.matching.rule import Rule
    from fpmatch.templates.minutiae import Template

MIN_PAIRS: Final = 8  # below which no scale is measured
MAX_LOG_DIFFERENCE: Final = math.log1p(0.07)  # of scales that count as one
SMALL_LOG_DIFFERENCE: Final = math.log1p(0.035)  # up to which a scale is not measured again
CANDIDATE_RATIOS: Final = (0.5, 0.63, 0.79, 0.89, 1.12, 1.26, 1.59, 2.0)  # where nothing matches
REFINEMENTS: Final = 2  # times that a scale is measured with the resolutions corrected
STANDARD_ERRORS: Final = 3.0  # that the ratio must lie beyond `MAX_LOG_DIFFERENCE`


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
    a = _positions_in_mm(probe, pairs[:, 0])
    b = _positions_in_mm(reference, pairs[:, 1])
    spread_a, spread_b = float((np.abs(a) ** 2).sum()), float((np.abs(b) ** 2).sum())
    together = float(abs(np.vdot(a, b)))
    if not (spread_a > 0 and spread_b > 0 and together > 0):
        return None
    # Of the fits of B to A and of A to B, which noise shrinks alike, the one between them.
    ratio = math.sqrt(spread_b / spread_a)
    coherence = min(together / math.sqrt(spread_a * spread_b), 1.0)
    error = ratio * math.sqrt((1 - coherence**2) / (2 * (len(pairs) - 2)))
    return assessed(ratio, error)


def assessed(ratio: float, error: float) -> ScaleMeasurement:
    """Return a measurement of a ratio with its standard error."""
    beyond = abs(math.log(ratio)) - STANDARD_ERRORS * error / ratio
    return ScaleMeasurement(ratio, error, differs=beyond > MAX_LOG_DIFFERENCE)


def find_scale(
    rule: Rule, probe: Side, reference: Side, pairs: NDArray[np.int32], *, match: bool
) -> ScaleMeasurement | None:
    """Find the scale between two prints, whether they match or not; None if it is unknown.

    Where they match, it is that of their pairs. Where they do not, the probe is compared at the
    other scales that are possible; one at which the prints match is a reason for the no (never a
    yes). Where a share of pairs decided, which no scale changes, none is tried. A scale that
    differs is measured again with the resolutions corrected: otherwise pairs far from the middle
    are lost. Images are at one scale.
    """
    ours, theirs, fixed = probe[0], reference[1], rule.matcher.wants_image
    compare = partial(compare_prepared, rule.matcher)
    if match:
        measured = measure_scale(ours, reference[0], pairs)
        near = measured is None or abs(math.log(measured.ratio)) < SMALL_LOG_DIFFERENCE
        if measured is None or near or fixed:
            return measured
        return _refined(rule, ours, reference, measured.ratio) or measured
    if rule.rho is not None or fixed:
        return None
    ratios = [ratio for ratio in CANDIDATE_RATIOS if _is_possible(ours, ratio)]
    possible = call_matcher(rule.matcher, "possible_scales", probe[1], theirs, ratios)
    # the reference, which is prepared for many comparisons, goes first: the score is the same
    tries = [
        (score_of(rule.calibration, compare(theirs, _at(rule, ours, ratio)).similarity), ratio)
        for ratio in possible
    ]
    score, ratio = max(tries, default=(-math.inf, 1.0))
    needed = rule.threshold + allowance(1.0, len(CANDIDATE_RATIOS))  # for so many tries
    return _refined(rule, ours, reference, ratio) if score >= needed else None


def _refined(rule: Rule, probe: Template, reference: Side, ratio: float) -> ScaleMeasurement | None:
    """Measure a scale that is `ratio`, roughly; None where it turns out to be 1."""
    measured = None
    for _ in range(REFINEMENTS):
        if not _is_possible(probe, ratio):
            return None
        pairs = compare_prepared(rule.matcher, _at(rule, probe, ratio), reference[1]).pairs
        refined = measure_scale(replace(probe, dpi=probe.dpi / ratio), reference[0], pairs)
        if refined is None:
            return None
        ratio *= refined.ratio
        measured = assessed(ratio, ratio / refined.ratio * refined.error)
    return measured if measured is not None and measured.differs else None


def _at(rule: Rule, probe: Template, ratio: float) -> Any:
    """Return a print whose lengths are `ratio` times as long, prepared."""
    return prepare_print(rule.matcher, replace(probe, dpi=probe.dpi / ratio), None)


def _is_possible(probe: Template, ratio: float) -> bool:
    return MIN_DPI <= probe.dpi / ratio <= MAX_DPI


def _positions_in_mm(template: Template, index: NDArray[np.integer]) -> NDArray[np.complex128]:
    """Return the positions of some minutiae about their mean, as complex numbers."""
    minutiae = template.minutiae
    positions = minutiae.x[index].astype(np.float64) + 1j * minutiae.y[index].astype(np.float64)
    from_mean: NDArray[np.complex128] = positions - positions.mean()
    return from_mean * (MM_PER_INCH / template.dpi)
