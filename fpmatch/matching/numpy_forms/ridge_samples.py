"""Numpy form of `_ridge_sample_kernel`: the ridge images of all cells at once."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

OUTSIDE: Final = 16


def restore(
    samples: Any,
    orientation: Any,
    mask: Any,
    start: Any,
    shape: Any,
    looked_up: Any,
    table: Any,
    halves: Any,
    ridges: Any,
) -> int:
    """Fill `ridges` inside the mask, print by print; `halves` is not used."""
    filled = 0
    for p in range(len(start) - 1):
        of, (rows, columns) = slice(start[p], start[p + 1]), np.asarray(shape)[p, :2].tolist()
        row, column = np.nonzero(np.asarray(mask)[of].reshape(rows, columns))
        inside = slice(filled, filled + len(row))
        filled = inside.stop
        own, both = np.asarray(orientation)[inside], np.full((2, rows + 2, columns + 2), OUTSIDE)
        kept = np.asarray(samples)[inside]
        both[:, row + 1, column + 1] = kept & 15, kept >> 4
        total = np.zeros((len(row), 8), np.uint64)
        for k, (half, down, right, _) in enumerate(np.asarray(looked_up)):
            total += np.asarray(table)[own, k, both[half, row + down, column + right]]
        highest = (total >> np.uint64(7)) & np.uint64(0x0101010101010101)
        bits = (highest * np.uint64(0x0102040810204080)) >> np.uint64(56)
        bits <<= np.arange(0, 64, 8, dtype=np.uint64)
        image = np.asarray(ridges)[of].reshape(rows, columns)
        image[row, column] = np.bitwise_or.reduce(bits, axis=1)
    return 0
