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

from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI, MM_PER_INCH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.result import Verification
    from fpmatch.templates.minutiae import Template

MIN_PAIRS: Final = 8  # below which no scale is measured
MAX_LOG_DIFFERENCE: Final = math.log1p(0.07)  # of scales that count as one
SMALL_LOG_DIFFERENCE: Final = math.log1p(0.035)  # up to which a scale is not measured again
STANDARD_ERRORS: Final = 3.0  # that the ratio must lie beyond `MAX_LOG_DIFFERENCE`
CANDIDATE_RATIOS: Final = (0.5, 0.63, 0.79, 0.89, 1.12, 1.26, 1.59, 2.0)  # where nothing matches
REFINEMENTS: Final = 2  # times that a scale is measured with the resolutions corrected


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
    """Measure the scale between two prints by their paired minutiae, as indices of shape (K, 2).

    There is none where there are too few pairs, or all lie in one place.

    Examples
    --------
    >>> from fpmatch.templates.minutiae import Minutiae, Template
    >>> x, y = np.meshgrid(np.arange(0, 100, 25.0), np.arange(0, 100, 25.0))
    >>> minutiae = Minutiae(x.ravel(), y.ravel(), np.zeros(16))
    >>> right = Template(minutiae, width=100, height=100, dpi=569)
    >>> wrong = Template(minutiae, width=100, height=100, dpi=500)
    >>> scale = measure_scale(wrong, right, np.column_stack([np.arange(16)] * 2))
    >>> round(scale.ratio, 3), scale.differs
    (0.879, True)
    """
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
    return _assessed(ratio, error)


def find_scale(verification: Verification) -> ScaleMeasurement | None:
    """Find the scale between the prints of a verification, whether they match or not.

    Where they match, it is that of their pairs. Where they do not, the probe is compared at the
    other scales that are possible; one at which the prints match is a reason for the no (never a
    yes). Where a share of pairs decided, which no scale changes, none is tried. A scale that
    differs is measured again with the resolutions corrected: otherwise pairs far from the middle
    are lost.

    Parameters
    ----------
    verification : Verification
        What ``fpmatch.verify`` returned.

    Returns
    -------
    ScaleMeasurement or None
        None where no scale can be measured.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template, find_scale, verify
    >>> empty = Template(Minutiae.empty(), width=300, height=300)
    >>> find_scale(verify(empty, empty)) is None
    True
    """
    v = verification
    if v.match:
        measured = measure_scale(v.probe, v.reference, v.pairs)
        if measured is None or abs(math.log(measured.ratio)) < SMALL_LOG_DIFFERENCE:
            return measured
        return _refined(v, measured.ratio) or measured
    if v.rho is not None or v.explanation is None:
        return None
    needed = v.threshold + 10.0 * math.log10(len(CANDIDATE_RATIOS))  # for so many tries
    possible = [ratio for ratio in CANDIDATE_RATIOS if _at_scale(v.probe, ratio)]
    tries = [
        (v.explanation.score_at_scale(rescaled), ratio)
        for ratio in v.explanation.possible_scales(possible)
        if (rescaled := _at_scale(v.probe, ratio))
    ]
    score, ratio = max(tries, default=(-math.inf, 1.0))
    return _refined(v, ratio) if score >= needed else None


def _refined(verification: Verification, ratio: float) -> ScaleMeasurement | None:
    """Measure a scale that is `ratio`, roughly; None where it turns out to be 1."""
    v, measured = verification, None
    if v.explanation is None:
        return None
    for _ in range(REFINEMENTS):
        rescaled = _at_scale(v.probe, ratio)
        if rescaled is None:
            return None
        pairs = v.explanation.pairs_at_scale(rescaled)
        refined = measure_scale(rescaled, v.reference, pairs)
        if refined is None:
            return None
        ratio *= refined.ratio
        measured = _assessed(ratio, ratio / refined.ratio * refined.error)
    return measured if measured is not None and measured.differs else None


def _at_scale(probe: Template, ratio: float) -> Template | None:
    """Return a print whose lengths are `ratio` times as long; None where that cannot be."""
    dpi = probe.dpi / ratio
    return replace(probe, dpi=dpi) if MIN_DPI <= dpi <= MAX_DPI else None


def _assessed(ratio: float, error: float) -> ScaleMeasurement:
    beyond = abs(math.log(ratio)) - STANDARD_ERRORS * error / ratio
    return ScaleMeasurement(ratio, error, differs=beyond > MAX_LOG_DIFFERENCE)


def _positions_in_mm(template: Template, index: NDArray[np.integer]) -> NDArray[np.complex128]:
    """Return the positions of some minutiae about their mean, as complex numbers."""
    minutiae = template.minutiae
    positions = minutiae.x[index].astype(np.float64) + 1j * minutiae.y[index].astype(np.float64)
    from_mean: NDArray[np.complex128] = positions - positions.mean()
    return from_mean * (MM_PER_INCH / template.dpi)
