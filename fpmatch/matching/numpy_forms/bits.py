"""Counts of bits, as the kernels of descriptors and ridges add them up."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def count_bits(words: NDArray[np.uint64]) -> tuple[NDArray[np.uint64], ...]:
    """Count, for each place of a bit, in how many of the rows it is set: ones, twos and so on."""
    ones, twos, fours, eights = np.zeros((4, words.shape[1]), np.uint64)
    for word in words:
        carry = ones & word
        ones ^= word
        rest = twos & carry
        twos ^= carry
        carry = fours & rest
        fours ^= rest
        eights ^= carry
    return ones, twos, fours, eights
