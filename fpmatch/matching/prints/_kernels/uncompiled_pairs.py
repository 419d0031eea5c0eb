"""The pairs of `_prefilter_kernel` in numpy, where it is not compiled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.constants.prints import (
    CELL,
    CELLS_ALONG,
    MOST_WEIGHT,
    NOT_FIRST,
    NOT_SECOND,
    OF_NEIGHBOUR,
    SECOND,
    SECTORS,
    STEPS,
    TOO_LITTLE,
    USUAL_ORIENTATIONS,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

EMPTY: Final = 2048  # a cell beyond the first grid


def pair(
    tables: Any,
    first: int,
    last: int,
    neighbour_bits: Any,
    orientation_bins: Any,
    flowing: bool,
    _other_first: bool,
) -> int:
    """Gather the pairs of minutiae that agree in enough words; return their number.

    All pairs are gathered, although only the heaviest are kept.
    """
    word = np.asarray(neighbour_bits)[first:last].astype(np.int64)
    on_sector, on_column, on_row = (word >> (STEPS + k) & 1 for k in range(3))
    further = SECOND + (word & CELL) + on_sector + SECTORS * (on_column + CELLS_ALONG * on_row)
    cells = [
        np.where(word & NOT_FIRST, EMPTY, word & CELL),
        np.where(word & NOT_SECOND, EMPTY, further),
    ]
    neighbours = _of_minutiae(tables.neighbour_table)[np.hstack(cells)].sum(axis=1, dtype=np.int64)
    orientations: int | NDArray[np.int64] = USUAL_ORIENTATIONS
    if flowing:
        bins = np.asarray(orientation_bins)[first:last]
        has = _of_minutiae(tables.orientation_table)[np.arange(bins.shape[1]), bins]
        orientations = has.sum(axis=1, dtype=np.int64)
    weight = np.minimum(OF_NEIGHBOUR * neighbours + orientations - TOO_LITTLE, MOST_WEIGHT)
    other, own = np.nonzero((neighbours > 0) & (weight > 0))
    weight = weight[other, own]
    pairs = tables.pairs
    np.asarray(pairs.pair)[:, : len(own)] = own, other, weight
    pairs.count, most = len(own), pairs.most
    pairs.least = least = np.sort(weight)[-most] if len(own) >= most else 0
    pairs.equal = most - np.count_nonzero(weight > least)
    return len(own)


def _of_minutiae(table: Any) -> NDArray[np.uint8]:
    """Return the bits of the words of a table: 1 for each minutia that has them, else 0."""
    words = np.asarray(table).astype("<u8")
    return np.unpackbits(words.view(np.uint8).reshape(*words.shape, 8), axis=-1, bitorder="little")
