"""Random streams, and smooth random fields for what varies slowly over a print.

Numbers of `uniform` are functions of a seed, a finger, an impression, a purpose and a counter:
those of many fingers are drawn at once, and those of any finger alone are the same.

References
----------
Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014 (SplitMix64).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

NO_IMPRESSION: Final = 0  # in the place of an impression's number: impressions count from 1
# Of the cubic B-spline sum of unit noise along both axes: the variance along one is 11/23.
_SPLINE_DEVIATION = 11 / 23
_GOLDEN: Final = np.uint64(0x9E3779B97F4A7C15)
_FACTORS: Final = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_SHIFTS: Final = np.uint64(30), np.uint64(27), np.uint64(31)
_KEPT_BITS: Final = np.uint64(40)  # shifted out, so that 24 bits remain, as float32 holds
_STEP: Final = np.float32(2.0**-24)


def random_streams(
    seed: int, finger: int, impression: int, purposes: range
) -> list[np.random.Generator]:
    """Return a stream of random numbers for each purpose, so that none influences another.

    Purposes are 1 to 6 for a master, 21 to 27 for its skin and 31 to 35 for an impression.
    """
    return [np.random.default_rng([seed, finger, impression, purpose]) for purpose in purposes]


def smooth_noise(
    shape: tuple[int, int], extent_px: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Draw a smooth random field: normal values on a grid, interpolated by cubic B-splines.

    The grid has a spacing of `extent_px` pixels; values about twice as far apart are independent.
    Mean 0, standard deviation about 1.
    """
    rows, columns = (int(side / extent_px) + 4 for side in shape)
    values = rng.standard_normal((rows, columns))
    tall = _along_first_axis(values, shape[0], extent_px)
    return _along_first_axis(tall.T, shape[1], extent_px).T / _SPLINE_DEVIATION


def _along_first_axis(
    values: NDArray[np.float64], length: int, extent_px: float
) -> NDArray[np.float64]:
    position = np.arange(length) / extent_px
    cell = position.astype(np.intp)
    t = (position - cell)[:, None]
    inner = (4 - 6 * t**2 + 3 * t**3) / 6, (1 + 3 * t + 3 * t**2 - 3 * t**3) / 6
    weights = (1 - t) ** 3 / 6, *inner, t**3 / 6
    total = np.zeros((length, values.shape[1]))
    for ahead, weight in enumerate(weights):
        total += weight * values[cell + ahead]
    return total


def spline_weights(length: int, extent: float) -> NDArray[np.float32]:
    """Return the weights (length, count) that interpolate a line of numbers `extent` steps apart.

    They are those of `smooth_noise`, over its deviation along one axis.
    """
    count = int(length / extent) + 4
    weights = _along_first_axis(np.eye(count), length, extent)
    return np.asarray(weights / np.sqrt(_SPLINE_DEVIATION), np.float32)


def keys_of(
    seed: int, finger: ArrayLike, impression: ArrayLike, purpose: int
) -> NDArray[np.uint64]:
    """Return the key of each finger's and impression's stream for a purpose, of their shape."""
    key = np.atleast_1d(np.uint64(seed))
    for part in (finger, impression, purpose):
        key = _mixed(key + _GOLDEN) + np.asarray(part, np.uint64)
    return _mixed(key)


def uniform(keys: NDArray[np.uint64], count: int) -> NDArray[np.float32]:
    """Return `count` numbers of each stream, evenly distributed over [0, 1), (..., count)."""
    counter = np.arange(1, count + 1, dtype=np.uint64) * _GOLDEN
    return (_mixed(keys[..., None] + counter) >> _KEPT_BITS).astype(np.float32) * _STEP


def _mixed(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    values = (values ^ (values >> _SHIFTS[0])) * _FACTORS[0]
    values = (values ^ (values >> _SHIFTS[1])) * _FACTORS[1]
    return values ^ (values >> _SHIFTS[2])
