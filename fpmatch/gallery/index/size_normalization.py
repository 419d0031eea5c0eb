"""Normalization of the scores of bit descriptors by the sizes of prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIZE_OFFSET: Final = 5
"""Added to the minutiae of the smaller print, by which its score is divided."""
LARGEST_SIZE: Final = 255  # larger prints are taken as of this size
LEAST_VARIANCE: Final = 0.1  # in relation to the mean one of all sizes
_LOG_SIZE: Final = np.log(np.arange(LARGEST_SIZE + 1) + float(SIZE_OFFSET))


def size_normalized(
    scores: NDArray[np.integer], sizes: NDArray[np.integer], probe_size: int
) -> NDArray[np.float64]:
    """Return a probe's scores in standard deviations above the mean of prints of the same size.

    It is the Z-norm of biometric scores, by the size of the reference, in minutiae; `scores` and
    `sizes` have shape (N,). Mean and variance are linear in the logarithm of the size, and fitted
    to these scores, few of which are of mates: which prints they are matters, not their order.

    Examples
    --------
    >>> some = np.array([14, 20, 30, 40])
    >>> size_normalized(some, sizes=np.array([15, 15, 40, 40]), probe_size=35).round(2).tolist()
    [-1.0, 1.0, -1.0, 1.0]
    """
    size = np.minimum(sizes, LARGEST_SIZE).astype(np.intp)
    divisor = np.minimum(np.arange(LARGEST_SIZE + 1), probe_size) + float(SIZE_OFFSET)
    normalized: NDArray[np.float64] = scores / divisor[size]
    # sums of whole numbers: exact, in any order
    whole = scores.astype(np.float64)
    count, total, squares = (
        np.bincount(size, weight, len(divisor)) for weight in (None, whole, whole * whole)
    )
    there = np.flatnonzero(count)
    each, of = count[there].astype(np.float64), divisor[there]
    mean = _line(total[there] / (each * of), there, each)
    near = mean[there]
    variance = squares[there] / (each * of * of) - 2 * near * total[there] / (each * of)
    variance += near * near
    least = LEAST_VARIANCE * float(np.average(variance, weights=each))
    spread = np.maximum(_line(variance, there, each), least)
    deviation = np.sqrt(np.where(spread > 0, spread, 1.0))
    normalized -= mean[size]
    normalized /= deviation[size]
    return normalized


def _line(
    value: NDArray[np.float64], size: NDArray[np.intp], weight: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the line through values at some sizes, for all; level where there is one size."""
    x = _LOG_SIZE[size]
    middle, level = (float(np.average(of, weights=weight)) for of in (x, value))
    spread = float(np.average((x - middle) ** 2, weights=weight))
    slope = float(np.average((x - middle) * (value - level), weights=weight))
    slope = slope / spread if spread > 0 else 0.0
    line: NDArray[np.float64] = level + slope * (_LOG_SIZE - middle)
    return line
