"""Prefilter: minutiae as bit descriptors, and how many of them agree in one rotation and shift.

Each minutia has a word for each of its neighbours: the cell of position and direction, in the
minutia's own frame, in which the neighbour lies in each of two grids. Twelve more words are the
bins of the ridge orientation at places around it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.constants import prints as fixed
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.prints.prepared import BitDescriptors, codes_at

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import Neighbourhoods, PreparedTemplate, PrintArea

    Floats = NDArray[np.float64]
    Numbers = NDArray[np.intp]

NO_CELL: Final = 2 * fixed.SECOND  # beyond both grids


def encode(
    points: Floats,
    quality: Floats,
    neighbours: Neighbourhoods,
    region: PrintArea,
    p: MatchParameters = USUAL,
) -> BitDescriptors:
    """Encode the minutiae (4, N) of a print, or those of best quality where there are many."""
    coded = np.zeros(len(quality), bool)
    coded[np.argsort(-quality, kind="stable")[: fixed.MAX_ENCODED]] = True
    turn = np.rint(np.arctan2(points[3], points[2]) * (fixed.TURNS / (2 * np.pi))).astype(np.int64)
    direction_bin = (turn % fixed.TURNS).astype(np.uint8)
    bits = _neighbour_bits(neighbours, coded, 1.0 / p.cell_px)
    bins = _orientation_bins(points, direction_bin, region)
    xy = np.ascontiguousarray(points[:2].T, np.float32)
    return BitDescriptors(xy, direction_bin, bits, bins, region.has_flow)


def rescaled(
    prepared: PreparedTemplate, ratio: float, p: MatchParameters = USUAL
) -> BitDescriptors:
    """Return the bit descriptors of a print whose lengths are multiplied by `ratio`."""
    points, frame = prepared.points.copy(), prepared.neighbourhoods.frame.copy()
    points[:2] *= ratio
    frame[:, :2] *= ratio
    neighbours = replace(prepared.neighbourhoods, frame=frame)
    region = replace(prepared.region, step=prepared.region.step * ratio)
    return encode(points, prepared.quality, neighbours, region, p)


def _neighbour_bits(
    neighbours: Neighbourhoods, coded: NDArray[np.bool_], per_px: float
) -> NDArray[np.uint16]:
    """Return the words of the neighbours; of the neighbours in one cell, the first counts."""
    frame = neighbours.frame[:, :4, : fixed.NEIGHBOUR_WORDS]
    u, v = (frame[:, k].astype(np.float64) * per_px + fixed.CELLS_ALONG // 2 for k in range(2))
    t = np.arctan2(frame[:, 3], frame[:, 2]).astype(np.float64) / (2 * np.pi) + fixed.APART
    t = np.where(t < 0.0, t + 1.0, t) * fixed.SECTORS
    rank = np.arange(frame.shape[2])
    inside = coded[:, None] & (rank < neighbours.count[:, None])
    inside &= (u >= 0.0) & (u < fixed.CELLS_ALONG) & (v >= 0.0) & (v < fixed.CELLS_ALONG)
    column, row, sector = (of.astype(np.int64) for of in (u, v, np.minimum(t, fixed.SECTORS - 1)))
    on_column, on_row = u - column >= 0.5, v - row >= 0.5
    cell = (row * fixed.CELLS_ALONG + column) * fixed.SECTORS + sector
    word = cell | (4 * on_row + 2 * on_column + (t - sector >= 0.5)) << fixed.STEPS
    further = inside & (row + on_row < fixed.CELLS_ALONG) & (column + on_column < fixed.CELLS_ALONG)
    earlier = rank[:, None] > rank
    for counts, place, bit in (
        (inside, cell, fixed.NOT_FIRST),
        (further, _second(word), fixed.NOT_SECOND),
    ):
        same = (place[:, :, None] == place[:, None]) & counts[:, None] & earlier
        word |= np.where(counts & ~same.any(axis=2), 0, bit)
    bits = np.full((len(coded), fixed.NEIGHBOUR_WORDS), fixed.NOWHERE, np.uint16)
    bits[:, : len(rank)] = np.where(inside, word, fixed.NOWHERE)
    return bits


def _second(word: Numbers) -> Numbers:
    """Return the cells of the second grid that words contain."""
    on_sector, on_column, on_row = (word >> (fixed.STEPS + k) & 1 for k in range(3))
    step = on_sector + fixed.SECTORS * (on_column + fixed.CELLS_ALONG * on_row)
    return np.asarray(fixed.SECOND + (word & fixed.CELL) + step)


def _orientation_bins(
    points: Floats, direction_bin: NDArray[np.uint8], region: PrintArea
) -> NDArray[np.uint8]:
    """Return the bins of the ridge orientation around each minutia, in its own frame, (N, 12)."""
    bins = np.full((points.shape[1], fixed.ORIENTATION_WORDS), fixed.UNKNOWN_BIN, np.uint8)
    if not region.has_flow:
        return bins
    z, d = points[::2] + 1j * points[1::2]
    code = codes_at(
        region, z[:, None] + d[:, None] * (fixed.FLOW_PLACES[0] + 1j * fixed.FLOW_PLACES[1])
    )
    relative = (code - 1.0) * fixed.ORIENTATION_BINS / fixed.ORIENTATIONS
    relative -= direction_bin[:, None] * (2.0 * fixed.ORIENTATION_BINS / fixed.TURNS)
    for _ in range(2):  # a turn of direction is two of orientation
        relative[relative < 0.0] += fixed.ORIENTATION_BINS
    known = code > 0
    bins[known] = np.minimum(relative[known].astype(np.int64), fixed.ORIENTATION_BINS - 1)
    return bins


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
    first = np.where(word & fixed.NOT_FIRST, NO_CELL, word & fixed.CELL)
    return np.hstack([first, np.where(word & fixed.NOT_SECOND, NO_CELL, _second(word))])
