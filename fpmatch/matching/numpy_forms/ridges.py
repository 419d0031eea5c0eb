"""Numpy form of `_ridge_kernel`: the correlation of the ridges of two prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.numpy_forms.bits import count_bits

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Words = NDArray[np.uint64]

SIDE: Final = 8  # bits along a cell
REACH: Final = 2  # bits by which ridges may lie off
SHIFTS: Final = 5
FEWEST_AROUND: Final = 4
ALL: Final = np.uint64(0xFFFFFFFFFFFFFFFF)
ONE: Final = np.uint64(1)


def cells_of(view: Any) -> NDArray[np.uint8]:
    """Return the codes of the cells of a print area, (rows, columns)."""
    cells = view.rows * view.columns
    codes: NDArray[np.uint8] = np.asarray(view.cell)[view.cell_at : view.cell_at + cells]
    return codes.reshape(view.rows, view.columns)


def ridges_of(view: Any) -> Words:
    """Return the ridge images of the cells of a print area, (rows, columns)."""
    cells = view.rows * view.columns
    words: Words = np.asarray(view.ridges)[view.cell_at : view.cell_at + cells]
    return words.reshape(view.rows, view.columns)


def inside(view: Any, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Return which places lie in the print area."""
    x = x * view.per_px - view.first_column
    y = -y * view.per_px - view.first_row
    within: NDArray[np.bool_] = (x >= 0.0) & (x < view.columns) & (y >= 0.0) & (y < view.rows)
    row, column = y[within].astype(np.intp), x[within].astype(np.intp)
    within[within] = cells_of(view)[row, column] > 0
    return within


@np.errstate(over="ignore", invalid="ignore")  # of transforms that lead nowhere
def correlate(correlator: Any, a: Any, b: Any) -> int:
    """Compare the cells where they are displaced to; return how many could be compared."""
    k = correlator
    row, column = np.nonzero(cells_of(a))
    half = 0.5 * a.step - 0.5
    px = (a.first_column + column) * a.step + half
    py = -((a.first_row + row) * a.step + half)
    drift = np.asarray(k.drift)[row // 2 * k.blocks + column // 2]
    x = k.c * px - k.s * py + k.x + drift[:, 0]
    y = k.s * px + k.c * py + k.y + drift[:, 1]
    within = inside(b, x, y)
    row, column = row[within], column[within]
    # with a border of one cell; of each cell and those to its left and right, and of all three rows
    size = a.rows + 2, a.columns + 2
    cells = size[0] * size[1]
    both = np.asarray(k.both)[:cells].reshape(size)
    agreeing = np.zeros((*size, SHIFTS), np.uint64)
    both[:] = 0
    both[row + 1, column + 1] = 1
    agreeing[row + 1, column + 1] = _counts(k, b, ridges_of(a)[row, column], x[within], y[within])
    wide = np.asarray(k.wide)[:cells].reshape(agreeing.shape)
    wide[:, 1:-1] = agreeing[:, :-2] + agreeing[:, 1:-1] + agreeing[:, 2:]
    near = both[:, :-2].astype(np.intp) + both[:, 1:-1] + both[:, 2:]
    around = (near[:-2] + near[1:-1] + near[2:])[row, column]
    enough = around >= FEWEST_AROUND
    row, column = row[enough] + 1, column[enough] + 1
    total = wide[row - 1, column] + wide[row, column] + wide[row + 1, column]
    k.cells = len(total)
    if k.cells > 0:
        # counts are the bytes of words
        best = np.ascontiguousarray(total).view(np.uint8).reshape(k.cells, -1).max(axis=1)
        value = 2.0 * best / (len(k.sample_row) * around[enough]) - 1.0
        k.correlation = float(np.cumsum(value)[-1]) / k.cells
    return int(k.cells)


def _counts(correlator: Any, b: Any, ridges: Words, x: Floats, y: Floats) -> Words:
    """Return the samples of cells that agree at each shift, their middles at places of B."""
    k = correlator
    per_bit = SIDE / b.step
    middle_u = (x + 0.5) * per_bit - SIDE * (b.first_column - 2.0) - REACH
    middle_v = (0.5 - y) * per_bit - SIDE * (b.first_row - 2.0) - REACH
    u, v = (
        np.add.outer(shift, middle)
        for shift, middle in zip(np.asarray(k.offset), (middle_u, middle_v), strict=True)
    )
    seen = (u >= 0.0) & (u < SIDE * (b.columns + 3.0)) & (v >= 0.0) & (v < SIDE * (b.rows + 3.0))
    near = np.zeros(u.shape, np.uint64)
    near[seen] = _windows(k, b.columns + 4, u[seen].astype(np.intp), v[seen].astype(np.intp))
    bit = SIDE * np.asarray(k.sample_row) + np.asarray(k.sample_column)
    valley = (ridges >> bit.astype(np.uint64)[:, None]) & ONE == 0
    near ^= np.where(valley, ALL, np.uint64(0))
    shift = (SIDE * np.arange(SHIFTS)).astype(np.uint64)
    spread = np.asarray(k.spread)
    counts = np.zeros((len(x), SHIFTS), np.uint64)
    for power, word in enumerate(count_bits(near)):
        counts += spread[(word[:, None] >> shift) & np.uint64(31)] << np.uint64(power)
    return counts


def _windows(correlator: Any, wide: int, u: NDArray[np.intp], v: NDArray[np.intp]) -> Words:
    """Return the 8 by 8 bits of the ridge image, `wide` cells wide, from column u and row v on."""
    cell = (v >> 3) * wide + (u >> 3)
    down = (SIDE * (v & 7)).astype(np.uint64)
    u &= 7
    image = np.asarray(correlator.ridge_image)
    near, far = (
        (image[first] >> down) | (image[first + wide] << (np.uint64(63) - down) << ONE)
        for first in (cell, cell + 1)
    )
    right = u.astype(np.uint64)
    kept = np.asarray(correlator.kept)[u]
    windows: Words = ((near >> right) & kept) | ((far << (np.uint64(SIDE) - right)) & ~kept)
    return windows


@np.errstate(over="ignore", invalid="ignore")  # of transforms that lead nowhere
def gather(correlator: Any, a: Any, b: Any) -> int:
    """Gather B's ridge image with two empty cells around it, and the samples' positions."""
    k = correlator
    rows, columns = b.rows + 4, b.columns + 4
    image = np.asarray(k.ridge_image)[: rows * columns].reshape(rows, columns)
    image[:] = 0
    image[2:-2, 2:-2] = ridges_of(b)
    px = (np.asarray(k.sample_column) - 3.5) * (a.step / SIDE)
    py = -(np.asarray(k.sample_row) - 3.5) * (a.step / SIDE)
    offset = np.asarray(k.offset)
    offset[0] = (k.c * px - k.s * py) * (SIDE / b.step)
    offset[1] = -(k.s * px + k.c * py) * (SIDE / b.step)
    return 0


@np.errstate(over="ignore", invalid="ignore")  # of transforms that lead nowhere
def common_cells(a: Any, b: Any, c: float, s: float, x: float, y: float) -> float:
    """Return how many cells of A fall into the region of B."""
    right, down = c * a.step * b.per_px, s * a.step * b.per_px
    row, column = np.nonzero(cells_of(a))
    first_x = x * b.per_px + right * (a.first_column + 0.5) - b.first_column
    bx = first_x + down * (a.first_row + row + 0.5) + column * right
    first_y = right * (a.first_row + row + 0.5) - b.first_row
    by = first_y - (y * b.per_px + down * (a.first_column + 0.5)) - column * down
    within = (bx >= 0.0) & (bx < b.columns) & (by >= 0.0) & (by < b.rows)
    places = by[within].astype(np.intp), bx[within].astype(np.intp)
    return float(np.count_nonzero(cells_of(b)[places]))
