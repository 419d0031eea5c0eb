"""Numpy form of `_ridge_sample_kernel`: the ridge images of all cells at once."""

from __future__ import annotations

from typing import Any

import numpy as np


def restore(
    samples: Any, orientation: Any, mask: Any, looked_up: Any, table: Any, halves: Any, ridges: Any
) -> int:
    """Fill `ridges` (rows, columns) inside the mask."""
    row, column = np.nonzero(np.asarray(mask))
    own, both = np.asarray(orientation), np.asarray(halves)
    both[:, row + 1, column + 1] = np.asarray(samples) & 15, np.asarray(samples) >> 4
    total = np.zeros((len(row), 8), np.uint64)
    for k, (half, down, right) in enumerate(np.asarray(looked_up)):
        total += np.asarray(table)[own, k, both[half, row + down, column + right]]
    highest = (total >> np.uint64(7)) & np.uint64(0x0101010101010101)
    bits = (highest * np.uint64(0x0102040810204080)) >> np.uint64(56)
    bits <<= np.arange(0, 64, 8, dtype=np.uint64)
    np.asarray(ridges)[row, column] = np.bitwise_or.reduce(bits, axis=1)
    return 0
