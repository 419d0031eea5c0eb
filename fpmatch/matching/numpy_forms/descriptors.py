"""Numpy forms of `_encode_kernel` and `_prefilter_kernel`: bit descriptors, and who shares them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.numpy_forms.bits import count_bits

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Numbers = NDArray[np.int64]

WORDS: Final = 12  # of neighbours, and as many of orientations
SIDE: Final = 16
SECTORS: Final = 8
APART: Final = 0.25
CELL: Final = 0x07FF
NOT_FIRST: Final = 0x0800
NOT_SECOND: Final = 0x8000
NOWHERE: Final = 0x8800
STEPS: Final = 12
SECOND: Final = 4096
EMPTY: Final = 2048  # a cell beyond the first grid
BINS: Final = 24
UNKNOWN: Final = 31
ORIENTATIONS: Final = 255
OF_NEIGHBOUR: Final = 3
TOO_LITTLE: Final = 8
MOST_WEIGHT: Final = 18


def second(word: Numbers) -> Numbers:
    """Return the places in the tables of the cells of the second grid that words contain."""
    place = SECOND + (word & CELL)
    place += (word >> STEPS & 1) + SECTORS * (word >> (STEPS + 1) & 1)
    return place + SECTORS * SIDE * (word >> (STEPS + 2) & 1)


def encode_neighbours(
    count: Any, frame: Any, angle: Any, coded: Any, per_px: float, word: Any
) -> int:
    """Fill `word` (N, 12) for the minutiae of a print that are `coded`; the others have none."""
    given = np.asarray(frame)[:, :, :WORDS].astype(np.float64)
    words = given.shape[2]
    u, v = given[:, 0] * per_px + SIDE // 2, given[:, 1] * per_px + SIDE // 2
    valid = np.arange(words) < np.where(coded, count, 0)[:, None]
    valid &= (u >= 0.0) & (u < SIDE) & (v >= 0.0) & (v < SIDE)
    share = np.asarray(angle)[:, :words].astype(np.float64) / (2 * np.pi) + APART
    share += share < 0.0
    t = np.where(valid, share, 0.0) * SECTORS
    u, v = np.where(valid, u, 0.0), np.where(valid, v, 0.0)
    column, row = u.astype(np.int64), v.astype(np.int64)
    sector = np.minimum(t.astype(np.int64), SECTORS - 1)
    on_column, on_row = u - column >= 0.5, v - row >= 0.5
    codes = (row * SIDE + column) * SECTORS + sector
    codes += (4 * on_row + 2 * on_column + (t - sector >= 0.5)) << STEPS
    # of the neighbours in one cell the first counts
    not_first = ~valid
    not_second = ~valid | (row + on_row == SIDE) | (column + on_column == SIDE)
    cell, other = codes & CELL, second(codes)
    same_cell = cell[:, :, None] == cell[:, None]
    same_other = other[:, :, None] == other[:, None]
    for k in range(1, words):
        not_first[:, k] |= (same_cell[:, k, :k] & ~not_first[:, :k]).any(axis=1)
        not_second[:, k] |= (same_other[:, k, :k] & ~not_second[:, :k]).any(axis=1)
    codes |= NOT_FIRST * not_first
    codes |= NOT_SECOND * not_second
    out = np.asarray(word)
    out[:] = NOWHERE
    out[:, :words] = np.where(valid, codes, NOWHERE)
    return 0


def encode_orientations(
    points: Any,
    direction_bin: Any,
    start: Any,
    cell: Any,
    cell_start: Any,
    shape: Any,
    step: Any,
    has_flow: Any,
    places: Any,
    word: Any,
) -> int:
    """Fill `word` with the bin of the ridge orientation at `places`, in each minutia's frame."""
    np.asarray(word)[:] = UNKNOWN
    for p in np.flatnonzero(has_flow).tolist():
        of = slice(start[p], start[p + 1])
        rows, columns, first_row, first_column = np.asarray(shape)[p].tolist()
        code = np.asarray(cell)[cell_start[p] : cell_start[p + 1]].reshape(rows, columns)
        px, py, c, s = np.asarray(points)[:, of, None]
        x = (px + c * places[0] - s * places[1]) / step[p] - first_column
        y = -(py + s * places[0] + c * places[1]) / step[p] - first_row
        known = (x >= 0.0) & (x < columns) & (y >= 0.0) & (y < rows)
        flow = np.zeros(known.shape, np.int64)
        flow[known] = code[y[known].astype(np.intp), x[known].astype(np.intp)]
        relative = (flow - 1.0) * BINS / ORIENTATIONS
        relative -= (np.asarray(direction_bin)[of] * (2.0 * BINS / 256.0))[:, None]
        while (below := relative < 0.0).any():
            relative[below] += BINS
        bins = np.minimum(relative.astype(np.int64), BINS - 1)
        np.asarray(word)[of] = np.where(flow > 0, bins, UNKNOWN)
    return 0


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

    Bit k of a word stands for minutia k in the tables. All pairs are gathered, although only the
    heaviest are kept.
    """
    table = np.asarray(tables.neighbour_table)
    words = np.asarray(neighbour_bits)[first:last].T.astype(np.int64)
    in_first = np.where(words & NOT_FIRST, EMPTY, words & CELL)
    in_second = np.where(words & NOT_SECOND, EMPTY, second(words))
    n1, n2, n4, n8 = count_bits(table[in_first])
    s1, s2, s4, s8 = count_bits(table[in_second])
    # the sum of both, from the ones up
    n1, carry = n1 ^ s1, n1 & s1
    n2, carry = n2 ^ s2 ^ carry, (n2 & s2) | ((n2 ^ s2) & carry)
    n4, carry = n4 ^ s4 ^ carry, (n4 & s4) | ((n4 ^ s4) & carry)
    n8, n16 = n8 ^ s8 ^ carry, (n8 & s8) | ((n8 ^ s8) & carry)
    if flowing:
        bins = np.asarray(orientation_bins)[first:last].T
        f1, f2, f4, f8 = count_bits(
            np.asarray(tables.orientation_table)[np.arange(WORDS)[:, None], bins]
        )
    else:  # six are taken to agree
        f1 = f8 = np.zeros_like(n1)
        f2 = f4 = ~f1
    # what weighs anything: three neighbours; two, and three orientations; one, and six
    enough = n4 | n8 | n16 | (n2 & (n1 | f4 | f8 | (f1 & f2))) | (n1 & (f8 | (f4 & f2)))
    some = enough.nonzero()[0]
    bits = np.arange(64, dtype=np.uint64)
    at, own = ((enough[some, None] >> bits) & np.uint64(1)).nonzero()
    other, place = some[at], own.astype(np.uint64)
    neighbours, orientations = (
        sum(((word[other] >> place) & np.uint64(1)).astype(np.int64) << k for k, word in of)
        for of in (enumerate((n1, n2, n4, n8, n16)), enumerate((f1, f2, f4, f8)))
    )
    weight = OF_NEIGHBOUR * neighbours - TOO_LITTLE + orientations
    tables.pairs.count = len(own)
    pairs = np.asarray(tables.pairs.pair)
    pairs[0, : len(own)], pairs[1, : len(own)] = own, other
    pairs[2, : len(own)] = weight = np.minimum(weight, MOST_WEIGHT)
    most = tables.pairs.most
    tables.pairs.least = least = np.sort(weight)[-most] if len(own) >= most else 0
    tables.pairs.equal = most - np.count_nonzero(weight > least)
    return len(own)


def locate(
    pairs: Any,
    own_turn: Any,
    own_xy: Any,
    first: int,
    xy: Any,
    direction_bin: Any,
    other_first: bool,
) -> int:
    """Write rows and positions of the pairs in prints A and B, and the rotation of B onto A."""
    n = pairs.count
    own, theirs = np.asarray(pairs.pair)[:2, :n]
    apart = np.asarray(own_turn)[own] - np.asarray(direction_bin)[first + theirs].astype(np.int32)
    places = np.asarray(own_xy)[own].T, np.asarray(xy)[first + theirs].T
    rows = own, theirs
    if other_first:
        same = theirs == theirs[:, None]
        rows, places, apart = (same.argmax(axis=1) if n else own, own), places[::-1], -apart
    np.asarray(pairs.row)[:, :n] = rows
    np.asarray(pairs.angle)[:n] = apart & 255
    np.asarray(pairs.a)[:, :n], np.asarray(pairs.b)[:, :n] = places
    return 0
