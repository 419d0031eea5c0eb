"""Prefilter: how many of the bit descriptors of two prints agree in one rotation and shift."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching import constants as fixed
from fpmatch.matching.parameters import USUAL, MatchParameters

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import BitDescriptors

    Numbers = NDArray[np.intp]

NO_CELL: Final = 2 * fixed.SECOND  # beyond both grids


def descriptor_similarity(a: BitDescriptors, b: BitDescriptors, p: MatchParameters = USUAL) -> int:
    """Return the greatest weight of pairs of minutiae that agree in one rotation and shift.

    Of the pairs of one minutia, the first counts.
    """
    i, j, weight = _pairs(a, b, p.most_pairs)
    angle = (a.direction_bin[i].astype(np.int64) - b.direction_bin[j]) % fixed.TURNS
    c, s = (of(angle * (2 * np.pi / fixed.TURNS))[:, None] for of in (np.cos, np.sin))
    xy_a, xy_b = (of.astype(np.float64).T for of in (a.xy[i], b.xy[j]))
    (dx, dy), (ex, ey) = (xy[:, None] - xy[:, :, None] for xy in (xy_b, xy_a))
    ex, ey = c * dx - s * dy - ex, s * dx + c * dy - ey
    near2, growth2 = p.near_px * p.near_px, p.near_per_px * p.near_per_px
    agree = ex * ex + ey * ey <= near2 + growth2 * (dx * dx + dy * dy)
    most_turn = round(p.pair_turn_deg * fixed.TURNS / 360)
    agree &= (angle - angle[:, None] + most_turn) % fixed.TURNS <= 2 * most_turn
    agree = np.triu(agree, 1)
    agree |= agree.T
    np.fill_diagonal(agree, val=True)
    own, other, weights = i.tolist(), j.tolist(), weight.tolist()
    best = 0
    for row in agree:
        counted: dict[int, int] = {}  # weights, by A's minutia
        of_b: set[int] = set()
        for k in np.flatnonzero(row).tolist():
            if own[k] not in counted and other[k] not in of_b:
                counted[own[k]] = weights[k]
                of_b.add(other[k])
        best = max(best, sum(counted.values()))
    return best


def _pairs(a: BitDescriptors, b: BitDescriptors, most: int) -> tuple[Numbers, Numbers, Numbers]:
    """Return the heaviest pairs of minutiae of A and B with their weights, by B, then by A."""
    own, other = (np.flatnonzero((of.neighbour_bits != fixed.NOWHERE).any(axis=1)) for of in (a, b))
    ours, theirs = _cells(a.neighbour_bits[own]), _cells(b.neighbour_bits[other])
    has = np.zeros((NO_CELL + 1, len(own)), np.uint8)
    has[ours, np.arange(len(own))[:, None]] = 1
    has[NO_CELL] = 0
    neighbours = has[theirs].sum(axis=1, dtype=np.int64)
    orientations = np.full(neighbours.shape, fixed.USUAL_ORIENTATIONS)
    if a.has_flow and b.has_flow:
        bins_a, bins_b = a.orientation_bins[own], b.orientation_bins[other, None]
        apart = (bins_b.astype(np.int64) - bins_a + 1) % fixed.ORIENTATION_BINS
        known = (bins_a != fixed.UNKNOWN_BIN) & (bins_b != fixed.UNKNOWN_BIN)
        orientations = (known & (apart <= 2)).sum(axis=2)
    weight = np.minimum(
        fixed.OF_NEIGHBOUR * neighbours + orientations - fixed.TOO_LITTLE, fixed.MOST_WEIGHT
    )
    j, i = np.nonzero((neighbours > 0) & (weight > 0))
    weight = weight[j, i]
    kept = np.sort(np.argsort(-weight, kind="stable")[:most])
    return own[i[kept]], other[j[kept]], weight[kept]


def _cells(words: NDArray[np.uint16]) -> Numbers:
    """Return the cells of both grids in which words (N, 12) count, (N, 24)."""
    word = words.astype(np.intp)
    on_sector, on_column, on_row = (word >> (fixed.STEPS + k) & 1 for k in range(3))
    step = on_sector + fixed.SECTORS * (on_column + fixed.CELLS_ALONG * on_row)
    second = fixed.SECOND + (word & fixed.CELL) + step
    first = np.where(word & fixed.NOT_FIRST, NO_CELL, word & fixed.CELL)
    return np.hstack([first, np.where(word & fixed.NOT_SECOND, NO_CELL, second)])
