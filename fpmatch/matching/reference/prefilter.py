"""Prefilter: minutiae as bit descriptors, and how many of them agree in one rotation and shift.

Each minutia has a word for each of its neighbours: the cell of position and direction, in the
minutia's own frame, in which the neighbour lies in each of two grids. Twelve more words are the
bins of the ridge orientation at places around it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.constants.prints import (
    APART,
    CELL,
    CELLS_ALONG,
    MAX_ENCODED,
    MOST_WEIGHT,
    NEIGHBOUR_WORDS,
    NOT_FIRST,
    NOT_SECOND,
    NOWHERE,
    OF_NEIGHBOUR,
    ORIENTATION_BINS,
    ORIENTATIONS,
    SECOND,
    SECTORS,
    STEPS,
    TOO_LITTLE,
    TURNS,
    UNKNOWN_BIN,
    USUAL_ORIENTATIONS,
)
from fpmatch.matching.prints.parameters import BitDescriptorParameters
from fpmatch.matching.prints.prepared import BitDescriptors

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import Neighbourhoods, PreparedTemplate
    from fpmatch.matching.prints.print_area import PrintArea

    Floats = NDArray[np.float64]
    Numbers = NDArray[np.intp]

NO_CELL: Final = 2 * SECOND  # beyond both grids


def encode(
    points: Floats,
    quality: Floats,
    neighbours: Neighbourhoods,
    region: PrintArea,
    parameters: BitDescriptorParameters | None = None,
) -> BitDescriptors:
    """Encode the minutiae (4, N) of a print, or those of best quality where there are many."""
    p = parameters or BitDescriptorParameters()
    coded = np.zeros(len(quality), bool)
    coded[np.argsort(-quality, kind="stable")[:MAX_ENCODED]] = True
    turn = np.rint(np.arctan2(points[3], points[2]) * (TURNS / (2 * np.pi))).astype(np.int64)
    direction_bin = (turn % TURNS).astype(np.uint8)
    bits = _neighbour_bits(neighbours, coded, 1.0 / p.cell_px)
    bins = _orientation_bins(points, direction_bin, region, p.places)
    xy = np.ascontiguousarray(points[:2].T, np.float32)
    return BitDescriptors(xy, direction_bin, bits, bins, region.has_flow)


def rescaled(
    prepared: PreparedTemplate, ratio: float, parameters: BitDescriptorParameters | None = None
) -> BitDescriptors:
    """Return the bit descriptors of a print whose lengths are multiplied by `ratio`."""
    points, frame = prepared.points.copy(), prepared.neighbourhoods.frame.copy()
    points[:2] *= ratio
    frame[:, :2] *= ratio
    neighbours = replace(prepared.neighbourhoods, frame=frame)
    region = replace(prepared.region, step=prepared.region.step * ratio)
    return encode(points, prepared.quality, neighbours, region, parameters)


def _neighbour_bits(
    neighbours: Neighbourhoods, coded: NDArray[np.bool_], per_px: float
) -> NDArray[np.uint16]:
    """Return the words of the neighbours; of the neighbours in one cell, the first counts."""
    frame = neighbours.frame[:, :4, :NEIGHBOUR_WORDS]
    u, v = (frame[:, k].astype(np.float64) * per_px + CELLS_ALONG // 2 for k in range(2))
    t = np.arctan2(frame[:, 3], frame[:, 2]).astype(np.float64) / (2 * np.pi) + APART
    t = np.where(t < 0.0, t + 1.0, t) * SECTORS
    rank = np.arange(frame.shape[2])
    inside = coded[:, None] & (rank < neighbours.count[:, None])
    inside &= (u >= 0.0) & (u < CELLS_ALONG) & (v >= 0.0) & (v < CELLS_ALONG)
    column, row, sector = (of.astype(np.int64) for of in (u, v, np.minimum(t, SECTORS - 1)))
    on_column, on_row = u - column >= 0.5, v - row >= 0.5
    cell = (row * CELLS_ALONG + column) * SECTORS + sector
    word = cell | (4 * on_row + 2 * on_column + (t - sector >= 0.5)) << STEPS
    further = inside & (row + on_row < CELLS_ALONG) & (column + on_column < CELLS_ALONG)
    earlier = rank[:, None] > rank
    for counts, place, bit in ((inside, cell, NOT_FIRST), (further, _second(word), NOT_SECOND)):
        same = (place[:, :, None] == place[:, None]) & counts[:, None] & earlier
        word |= np.where(counts & ~same.any(axis=2), 0, bit)
    bits = np.full((len(coded), NEIGHBOUR_WORDS), NOWHERE, np.uint16)
    bits[:, : len(rank)] = np.where(inside, word, NOWHERE)
    return bits


def _second(word: Numbers) -> Numbers:
    """Return the cells of the second grid that words contain."""
    on_sector, on_column, on_row = (word >> (STEPS + k) & 1 for k in range(3))
    step = on_sector + SECTORS * (on_column + CELLS_ALONG * on_row)
    return np.asarray(SECOND + (word & CELL) + step)


def _orientation_bins(
    points: Floats, direction_bin: NDArray[np.uint8], region: PrintArea, places: Floats
) -> NDArray[np.uint8]:
    """Return the bins of the orientation at `places` (2, W) in each minutia's frame, (N, W)."""
    bins = np.full((points.shape[1], places.shape[1]), UNKNOWN_BIN, np.uint8)
    if not region.has_flow:
        return bins
    x, y, c, s = points[:, :, None]
    x = (x + c * places[0] - s * places[1]) / region.step - region.first_column
    y = -(y + s * places[0] + c * places[1]) / region.step - region.first_row
    rows, columns = region.code.shape
    inside = (x >= 0.0) & (x < columns) & (y >= 0.0) & (y < rows)
    code = np.zeros(bins.shape, np.int64)
    code[inside] = region.code[y[inside].astype(np.intp), x[inside].astype(np.intp)]
    relative = (code - 1.0) * ORIENTATION_BINS / ORIENTATIONS
    relative -= direction_bin[:, None] * (2.0 * ORIENTATION_BINS / TURNS)
    for _ in range(2):  # a turn of direction is two of orientation
        relative[relative < 0.0] += ORIENTATION_BINS
    known = code > 0
    bins[known] = np.minimum(relative[known].astype(np.int64), ORIENTATION_BINS - 1)
    return bins


def descriptor_similarity(
    a: BitDescriptors, b: BitDescriptors, parameters: BitDescriptorParameters | None = None
) -> int:
    """Return the greatest weight of pairs of minutiae that agree in one rotation and shift.

    Of the pairs of one minutia, the first counts.
    """
    p = parameters or BitDescriptorParameters()
    i, j, weight = _pairs(a, b, p.most_pairs)
    angle = (a.direction_bin[i].astype(np.int64) - b.direction_bin[j]) % TURNS
    c, s = (of(angle * (2 * np.pi / TURNS))[:, None] for of in (np.cos, np.sin))
    xy_a, xy_b = (of.astype(np.float64).T for of in (a.xy[i], b.xy[j]))
    (dx, dy), (ex, ey) = (xy[:, None] - xy[:, :, None] for xy in (xy_b, xy_a))
    ex, ey = c * dx - s * dy - ex, s * dx + c * dy - ey
    near2, growth2 = p.near_px * p.near_px, p.near_per_px * p.near_per_px
    agree = ex * ex + ey * ey <= near2 + growth2 * (dx * dx + dy * dy)
    most_turn = round(p.pair_turn_deg * TURNS / 360)
    agree &= (angle - angle[:, None] + most_turn) % TURNS <= 2 * most_turn
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
    own, other = (np.flatnonzero((of.neighbour_bits != NOWHERE).any(axis=1)) for of in (a, b))
    ours, theirs = _cells(a.neighbour_bits[own]), _cells(b.neighbour_bits[other])
    has = np.zeros((NO_CELL + 1, len(own)), np.uint8)
    has[ours, np.arange(len(own))[:, None]] = 1
    has[NO_CELL] = 0
    neighbours = has[theirs].sum(axis=1, dtype=np.int64)
    orientations = np.full(neighbours.shape, USUAL_ORIENTATIONS)
    if a.has_flow and b.has_flow:
        bins_a, bins_b = a.orientation_bins[own], b.orientation_bins[other, None]
        apart = (bins_b.astype(np.int64) - bins_a + 1) % ORIENTATION_BINS
        known = (bins_a != UNKNOWN_BIN) & (bins_b != UNKNOWN_BIN)
        orientations = (known & (apart <= 2)).sum(axis=2)
    weight = np.minimum(OF_NEIGHBOUR * neighbours + orientations - TOO_LITTLE, MOST_WEIGHT)
    j, i = np.nonzero((neighbours > 0) & (weight > 0))
    weight = weight[j, i]
    kept = np.sort(np.argsort(-weight, kind="stable")[:most])
    return own[i[kept]], other[j[kept]], weight[kept]


def _cells(words: NDArray[np.uint16]) -> Numbers:
    """Return the cells of both grids in which words (N, 12) count, (N, 24)."""
    word = words.astype(np.intp)
    first = np.where(word & NOT_FIRST, NO_CELL, word & CELL)
    return np.hstack([first, np.where(word & NOT_SECOND, NO_CELL, _second(word))])
