"""Normalization of the scores of bit descriptors by the sizes of prints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIZE_OFFSET: Final = 5
"""Added to the minutiae of the smaller print, by which its score is divided."""
LARGEST_SIZE: Final = 255  # larger prints are taken as of this size
LEAST_PRINTS: Final = 500  # from which the mean of a size is estimated
USUAL_MEAN: Final = 0.73  # of fewer, those of synthetic prints
USUAL_DEVIATION: Final = 0.335
LEAST_VARIANCE: Final = 0.1  # in relation to the mean one of all sizes
_LOG_SIZE: Final = np.log(np.arange(LARGEST_SIZE + 1) + float(SIZE_OFFSET))


@dataclass(frozen=True, slots=True, eq=False)
class SizeNormalization:
    """Turn a probe's scores into standard deviations above the mean of prints of the same size.

    It is the Z-norm of biometric scores, by the size of the reference. Mean and variance are linear
    in the logarithm of the size, and fitted to the scores of many prints, few of which are mates.
    What is fitted depends on which prints these are, not on their order.
    """

    divisor: NDArray[np.float64]  # (256,): of prints of each size, what a score is divided by,
    mean: NDArray[np.float64]  # then the mean
    deviation: NDArray[np.float64]  # and the standard deviation

    @classmethod
    def fit(
        cls, scores: NDArray[np.integer], sizes: NDArray[np.integer], probe_size: int
    ) -> SizeNormalization:
        """Fit it to the scores of prints of some sizes, in minutiae: both of shape (N,).

        Of fewer than 500 prints it is the usual one.
        """
        size = np.minimum(sizes, LARGEST_SIZE).astype(np.intp)
        divisor = np.minimum(np.arange(LARGEST_SIZE + 1), probe_size) + float(SIZE_OFFSET)
        every = np.ones(LARGEST_SIZE + 1)
        if len(size) < LEAST_PRINTS:
            return cls(divisor, USUAL_MEAN * every, USUAL_DEVIATION * every)
        # sums of whole numbers: exact, in any order
        whole = scores.astype(np.float64)
        count, total, squares = (
            np.bincount(size, weight, len(every)) for weight in (None, whole, whole * whole)
        )
        there = np.flatnonzero(count)
        each, of = count[there].astype(np.float64), divisor[there]
        mean = _line(total[there] / (each * of), there, each)
        near = mean[there]
        variance = squares[there] / (each * of * of) - 2 * near * total[there] / (each * of)
        variance += near * near
        least = LEAST_VARIANCE * float(np.average(variance, weights=each))
        spread = np.maximum(_line(variance, there, each), least)
        return cls(divisor, mean, np.sqrt(np.where(spread > 0, spread, 1.0)))

    def of(self, scores: NDArray[np.integer], sizes: NDArray[np.integer]) -> NDArray[np.float64]:
        """Return the normalized scores of prints of some sizes, of shape (N,)."""
        size = np.minimum(sizes, LARGEST_SIZE).astype(np.intp)
        normalized: NDArray[np.float64] = scores / self.divisor[size]
        normalized -= self.mean[size]
        normalized /= self.deviation[size]
        return normalized


def size_normalized(
    scores: NDArray[np.integer], sizes: NDArray[np.integer], probe_size: int
) -> NDArray[np.float64]:
    """Return the scores of prints, normalized by their sizes (see `SizeNormalization`).

    Examples
    --------
    >>> few = np.array([14, 20, 30])
    >>> size_normalized(few, sizes=np.array([15, 15, 40]), probe_size=35).round(2).tolist()
    [-0.09, 0.81, 0.06]
    """
    return SizeNormalization.fit(scores, sizes, probe_size).of(scores, sizes)


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
