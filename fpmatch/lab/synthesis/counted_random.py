"""Random numbers that are functions of a seed, a finger, an impression, a purpose and a counter.

Those of many fingers are drawn at once, and those of any finger alone are the same.

References
----------
Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014 (SplitMix64).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

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


def uniform(keys: NDArray[np.uint64], count: int) -> NDArray[np.float32]:
    """Return `count` numbers of each stream, evenly distributed over [0, 1), (..., count)."""
    counter = np.arange(1, count + 1, dtype=np.uint64) * _GOLDEN
    return (_mixed(keys[..., None] + counter) >> _KEPT_BITS).astype(np.float32) * _STEP


def _mixed(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    values = (values ^ (values >> _SHIFTS[0])) * _FACTORS[0]
    values = (values ^ (values >> _SHIFTS[1])) * _FACTORS[1]
    return values ^ (values >> _SHIFTS[2])
