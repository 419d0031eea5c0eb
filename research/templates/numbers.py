"""Random numbers, angles and fields of many fingers at once.

Numbers of `uniform` are functions of a seed, a finger, an impression, a purpose and a counter:
those of many fingers are drawn at once, and those of any finger alone are the same. Angles are
65,536ths of a turn.

References
----------
Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014 (SplitMix64).
Abramowitz, Stegun, "Handbook of mathematical functions", 1964: 4.4.49, the arc tangent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.synthesis.noise import SPLINE_DEVIATION, interpolated

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float32]
    Doubles = NDArray[np.float64]
    Ints = NDArray[np.int64]

TURN: Final = 65536
HALF, QUARTER, MASK = TURN // 2, TURN // 4, TURN - 1
RADIANS: Final = 9.587379924285257e-05  # of a 65,536th of a turn
SQRT_12: Final = np.float32(np.sqrt(12))  # times an even number around 0: a deviation of 1
_TINY: Final = 1e-12
_GOLDEN: Final = np.uint64(0x9E3779B97F4A7C15)
_FACTORS: Final = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_SHIFTS: Final = np.uint64(30), np.uint64(27), np.uint64(31)
_KEPT_BITS: Final = np.uint64(40)  # shifted out, so that 24 bits remain, as float32 holds
_STEP: Final = np.float32(2.0**-24)


def keys_of(
    seed: int, finger: ArrayLike, impression: ArrayLike, purpose: int
) -> NDArray[np.uint64]:
    """Return the key of each finger's and impression's stream for a purpose, of their shape."""
    key = np.atleast_1d(np.uint64(seed))
    for part in (finger, impression, purpose):
        key = _mixed(key + _GOLDEN) + np.asarray(part, np.uint64)
    return _mixed(key)


def uniform(keys: NDArray[np.uint64], count: int) -> Floats:
    """Return `count` numbers of each stream, evenly distributed over [0, 1), (..., count)."""
    counter = np.arange(1, count + 1, dtype=np.uint64) * _GOLDEN
    return (_mixed(keys[..., None] + counter) >> _KEPT_BITS).astype(np.float32) * _STEP


def _mixed(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    values = (values ^ (values >> _SHIFTS[0])) * _FACTORS[0]
    values = (values ^ (values >> _SHIFTS[1])) * _FACTORS[1]
    return values ^ (values >> _SHIFTS[2])


def between(limits: tuple[float, float], share: NDArray[np.floating]) -> Doubles:
    """Return the values at shares of the way between two limits."""
    low, high = limits
    return np.asarray(low + (high - low) * share, np.float64)


def normal(even: NDArray[np.floating]) -> Doubles:
    """Return standard normal numbers from pairs of even ones, (..., 2) (Box and Muller)."""
    radius = np.sqrt(-2 * np.log1p(-even[..., 0].astype(np.float64)))
    return np.asarray(radius * np.cos(2 * np.pi * even[..., 1]), np.float64)


def smooth_grids(
    keys: NDArray[np.uint64], shape: tuple[int, int], extent: float, skip: int = 0
) -> Floats:
    """Draw smooth random fields (B, rows, columns), as `smooth_noise`; extent in their steps.

    The numbers of the streams from the one after `skip` on are used.
    """
    down, across = (_weights(side, extent) for side in shape)
    rows, columns = down.shape[1], across.shape[1]
    values = uniform(keys, skip + rows * columns)[:, skip:] - np.float32(0.5)
    values = values.reshape(-1, rows, columns) * SQRT_12
    return np.asarray(down @ values @ across.T, np.float32)


def _weights(length: int, extent: float) -> Floats:
    """Return the weights (length, count) that interpolate a line of numbers `extent` apart."""
    weights = interpolated(np.eye(int(length / extent) + 4), length, extent)
    return np.asarray(weights / np.sqrt(SPLINE_DEVIATION), np.float32)


def angle_of(y: NDArray[np.floating], x: NDArray[np.floating]) -> Ints:
    """Return the angles of vectors, to about a 65,536th of a turn."""
    y, x = np.asarray(y, np.float64), np.asarray(x, np.float64)
    ax, ay = np.abs(x), np.abs(y)
    t = np.minimum(ax, ay) / (np.maximum(ax, ay) + _TINY)
    u = t * t
    a = 0.9998660 + u * (-0.3302995 + u * (0.1801410 + u * (-0.0851330 + u * 0.0208351)))
    a *= t
    a = np.where(ay > ax, 0.5 * np.pi - a, a)
    a = np.where(x < 0, np.pi - a, a)
    a = np.where(y < 0, -a, a)
    return np.asarray(np.floor(a * (TURN / (2 * np.pi)) + 0.5).astype(np.int64) & MASK)


def cosine(angle: Ints) -> Doubles:
    """Return the cosines of angles."""
    whole = angle & MASK
    t = np.where(whole < HALF, whole, TURN - whole) * (2 * RADIANS)  # 0 to 2π
    t = 0.5 * t - 0.5 * np.pi
    u = t * t
    return np.asarray(-t * (1 - u / 6 * (1 - u / 20 * (1 - u / 42 * (1 - u / 72)))))
