"""Numpy form of the correlation of ridges: of `_ridge_kernel`, not compiled, and of the reference.

It does the kernel's arithmetic in the kernel's order: the results are the same to the last bit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Numbers = NDArray[np.intp]
    Bits = NDArray[np.bool_]

SIDE: Final = 8  # bits along a cell
REACH: Final = 2  # bits by which ridges may lie off
SHIFTS: Final = 5
LANE: Final = 12  # bits of a count in the kernel's words
FEWEST_AROUND: Final = 4  # cells of 3 by 3 that must be in both prints


def bits_of(ridges: NDArray[np.uint64]) -> Bits:
    """Return the ridge images of cells (rows, columns) as one, 8 by 8 bits a cell."""
    rows, columns = ridges.shape
    bytes_ = ridges.astype("<u8").view(np.uint8).reshape(rows, columns, SIDE)
    bits = np.unpackbits(bytes_, axis=2, bitorder="little").reshape(rows, columns, SIDE, SIDE)
    return bits.transpose(0, 2, 1, 3).reshape(SIDE * rows, SIDE * columns).astype(bool)


def count_agreeing(ours: Bits, picture: Bits, u: Floats, v: Floats) -> NDArray[np.uint16]:
    """Return how many samples (K, S) of each cell agree with B at each shift, (K, 5, 5).

    They lie in column u and row v of B's picture with an edge of two cells, less `REACH`; beyond
    it, as wherever B has no cell, there is a valley.
    """
    windows = sliding_window_view(np.pad(picture, 2 * SIDE), (SHIFTS, SHIFTS))
    rows, columns = picture.shape
    seen = (u >= 0.0) & (u < columns + 3 * SIDE) & (v >= 0.0) & (v < rows + 3 * SIDE)
    theirs = np.zeros((*u.shape, SHIFTS, SHIFTS), bool)
    theirs[seen] = windows[v[seen].astype(np.intp), u[seen].astype(np.intp)]
    agreeing = np.sum(theirs == ours[:, :, None, None], axis=1, dtype=np.uint16)
    return np.asarray(agreeing)


def best_shifts(
    samples: int, row: Numbers, column: Numbers, around: NDArray[Any], rows_of_three: NDArray[Any]
) -> Floats:
    """Return the correlations of the cells that are compared, with those around them.

    Each is that at the shift under which most samples agree. A cell lies in a row and a column of
    tables with an edge: `around` (rows, columns) is 1 where a cell lies in both prints, and
    `rows_of_three` (rows, columns, 5, 5) has the samples that agree in a cell and those beside it.
    """
    total = rows_of_three[row - 1, column] + rows_of_three[row, column]
    total += rows_of_three[row + 1, column]
    near = beside(around.astype(np.intp))
    cells = near[row - 1, column] + near[row, column] + near[row + 1, column]
    enough = cells >= FEWEST_AROUND
    best = total[enough].reshape(-1, SHIFTS * SHIFTS).max(axis=1, initial=0)
    correlations: Floats = 2.0 * best / (samples * cells[enough]) - 1.0
    return correlations


def beside(agreeing: NDArray[Any]) -> NDArray[Any]:
    """Return the sums over each cell of a table with an edge and those to its left and right."""
    total = np.zeros_like(agreeing)
    total[:, 1:-1] = agreeing[:, :-2] + agreeing[:, 1:-1] + agreeing[:, 2:]
    return total


@np.errstate(over="ignore", invalid="ignore")  # of transforms that lead nowhere
def correlate(correlator: Any, a: Any, b: Any) -> int:
    """Compare the cells where they are displaced to; return how many could be compared."""
    k = correlator
    (code_a, ridges_a), (_, ridges_b) = map(_cells_of, (a, b))
    row, column = np.nonzero(code_a)
    half = 0.5 * a.step - 0.5
    px = (a.first_column + column) * a.step + half
    py = -((a.first_row + row) * a.step + half)
    drift = np.asarray(k.drift)[row // 2 * k.blocks + column // 2]
    x = k.c * px - k.s * py + k.x + drift[:, 0]
    y = k.s * px + k.c * py + k.y + drift[:, 1]
    within = _inside(b, x, y)
    row, column, x, y = row[within], column[within], x[within], y[within]
    per_bit = SIDE / b.step
    middle_u = (x + 0.5) * per_bit - SIDE * (b.first_column - 2.0) - REACH
    middle_v = (0.5 - y) * per_bit - SIDE * (b.first_row - 2.0) - REACH
    offset = np.asarray(k.offset)[:, : k.samples]
    u, v = (np.add.outer(m, o) for m, o in zip((middle_u, middle_v), offset, strict=True))
    sample = SIDE * np.asarray(k.sample_row)[: k.samples] + np.asarray(k.sample_column)[: k.samples]
    ours = (ridges_a[row, column, None] >> sample.astype(np.uint64)) & np.uint64(1) > 0
    # with an edge of one cell; the five counts of a row of shifts are one word
    size = a.rows + 2, a.columns + 2
    cells = size[0] * size[1]
    both = np.asarray(k.both)[:cells].reshape(size)
    both[:] = 0
    both[row + 1, column + 1] = 1
    agreeing = np.zeros((*size, SHIFTS, SHIFTS), np.uint16)
    agreeing[row + 1, column + 1] = count_agreeing(ours, bits_of(ridges_b), u, v)
    wide = beside(agreeing)
    words = wide.astype(np.uint64) << np.arange(0, LANE * SHIFTS, LANE, dtype=np.uint64)
    np.asarray(k.wide)[:cells] = words.sum(axis=-1).reshape(cells, SHIFTS)
    value = best_shifts(len(sample), row + 1, column + 1, both, wide)
    k.cells = len(value)
    if k.cells > 0:
        k.correlation = float(np.cumsum(value)[-1]) / k.cells
    return int(k.cells)


def _cells_of(view: Any) -> tuple[NDArray[np.uint8], NDArray[np.uint64]]:
    """Return the codes and the ridge images of the cells of a print area, (rows, columns)."""
    size = view.rows, view.columns
    cells = slice(view.cell_at, view.cell_at + view.rows * view.columns)
    return np.asarray(view.cell)[cells].reshape(size), np.asarray(view.ridges)[cells].reshape(size)


def _inside(view: Any, x: Floats, y: Floats) -> Bits:
    """Return which places lie in the print area."""
    x = x * view.per_px - view.first_column
    y = -y * view.per_px - view.first_row
    within: Bits = (x >= 0.0) & (x < view.columns) & (y >= 0.0) & (y < view.rows)
    row, column = y[within].astype(np.intp), x[within].astype(np.intp)
    within[within] = _cells_of(view)[0][row, column] > 0
    return within
