"""Numpy forms of `_term_kernel` and `_vote_kernel`, for where these are not compiled."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from fpmatch.gallery.index.model import CURVATURES, LENGTHS, SECTORS

# The kernels have the same numbers.
TURN: Final = 2 * np.pi
LENGTH_ERROR_PX: Final = 2.5
GROWTH: Final = 0.03  # of the error, by the length
WIDTH: Final = 2.5  # of a cell of length, in errors
STRONG: Final = 0.6108652381980153
MODERATE: Final = 0.2617993877991494
BORDERS: Final = np.array([-STRONG, -MODERATE, 0.0, MODERATE, STRONG])
UNKNOWN: Final = 4.0  # greater than any curvature
SIDE_PX: Final = 28.0
LEAST_KNOWN: Final = 0.25
ROTATIONS: Final = 64
PLACES: Final = 32
PER_PX: Final = 0.125  # steps of a place
SHAPE: Final = (4, 16, 4)  # cells of shifts along x, of rotation, of shifts along y
CELLS: Final = 256
MOST: Final = 63
PRODUCT_BITS: Final = 5
MOST_VOTES: Final = 65_535


def measure_curvatures(
    points: Any,
    edge: Any,
    code: Any,
    doubled: Any,
    step: float,
    first_row: float,
    first_column: float,
    curvature: Any,
) -> int:
    """Fill `curvature` for the edges (E, 2) of a mesh, as the kernel does."""
    points, code = np.asarray(points), np.asarray(code)
    i, j = np.asarray(edge).reshape(-1, 2).T
    dx, dy = points[0, j] - points[0, i], points[1, j] - points[1, i]
    length = np.sqrt(dx * dx + dy * dy)
    scale = np.where(length > 0.0, SIDE_PX / np.maximum(length, 1e-300), 0.0)
    middle_x, middle_y = (0.5 * (row[i] + row[j]) for row in points[:2])
    # cells around the print have no orientation
    around = np.asarray(doubled)[:, np.pad(code, 1)]
    rows, columns = code.shape
    known = length > 0.0
    means = []
    for to_side in (scale, -scale):
        x = (middle_x - to_side * dy) / step - first_column - 0.5
        y = -(middle_y + to_side * dx) / step - first_row - 0.5
        column, row = np.floor(x), np.floor(y)
        mean = np.zeros((2, len(x)))
        for k in range(4):
            share_x = x - column if k & 1 else 1.0 - (x - column)
            share_y = y - row if k >> 1 else 1.0 - (y - row)
            at_x = np.clip(column + (k & 1) + 1, 0, columns + 1).astype(np.int64)
            at_y = np.clip(row + (k >> 1) + 1, 0, rows + 1).astype(np.int64)
            mean += share_x * share_y * around[:, at_y, at_x]
        known &= (mean * mean).sum(0) > LEAST_KNOWN
        means.append(mean)
    (c, s), (other_c, other_s) = means
    across = 0.5 * np.arctan2(s * other_c - c * other_s, c * other_c + s * other_s)
    curvature[:] = np.where(known, across, UNKNOWN)
    return 0


def describe_edges(points: Any, edge: Any, curvature: Any, term: Any, pose: Any) -> int:
    """Fill `term` and `pose` for the edges (E, 2) of a mesh, as the kernel does."""
    points = np.asarray(points)
    i, j = np.asarray(edge).reshape(-1, 2).T
    dx, dy = points[0, j] - points[0, i], points[1, j] - points[1, i]
    length, along = np.sqrt(dx * dx + dy * dy), np.arctan2(dy, dx)
    cell = (np.log1p(GROWTH / LENGTH_ERROR_PX * length) / GROWTH / WIDTH).astype(np.int64)
    cell = np.minimum(cell, LENGTHS - 1)
    for end in (i, j):
        relative = np.arctan2(points[3, end], points[2, end]) - along
        cell = cell * SECTORS + _sector(relative, SECTORS)
    at = np.searchsorted(BORDERS, curvature) + (np.asarray(curvature) >= UNKNOWN)
    term[:] = cell * CURVATURES + at
    cell = _sector(along + 0.5 * TURN / ROTATIONS, ROTATIONS)
    for row in points[:2]:
        place = np.floor(0.5 * (row[i] + row[j]) * PER_PX).astype(np.int64)
        cell = cell * PLACES + (place & (PLACES - 1))
    pose[:] = cell
    return 0


def count_votes(
    start: Any,
    posting: Any,
    term: Any,
    weight: Any,
    reading: Any,
    shift: Any,
    factor: Any,
    cursor: Any,
    table: Any,
    votes: Any,
) -> int:
    """Fill `votes` with the greatest sum of the votes of each print, as the kernel does."""
    start, term = np.asarray(start).astype(np.int64), np.asarray(term)
    length = start[term + 1] - start[term]
    q = np.repeat(np.arange(len(term)), length)
    at = np.arange(len(q)) + np.repeat(start[term] - (np.cumsum(length) - length), length)
    postings, of = np.asarray(posting)[at].astype(np.int64), np.asarray(reading)[q]
    own = np.asarray(shift)[of, postings >> 10 & (ROTATIONS - 1)].astype(np.int64)
    x, y = (postings >> 5) - (own >> 5), postings - own
    cell = (x << 3 & 192) + (own >> 8 & 60) + (y >> 3 & 3)
    counted = np.bincount(
        (postings >> 16) * CELLS + cell, np.asarray(weight)[q], len(votes) * CELLS
    )
    cells = np.minimum(counted, MOST).astype(np.uint8).reshape(-1, *SHAPE)
    cells += np.roll(cells, -1, 1)
    cells += np.roll(cells, -1, 2)
    best = cells.reshape(-1, CELLS).max(1, initial=0).astype(np.uint32)
    votes[:] = best * np.asarray(factor) >> 2
    return 0


def add_similarity(embedding: Any, probe: Any, votes: Any) -> int:
    """Add to the `votes` how similar embeddings are to the probe's, as the kernel does."""
    product = np.asarray(embedding).astype(np.int64) @ np.asarray(probe).astype(np.int64)
    added = np.maximum(product, 0) >> PRODUCT_BITS
    votes[:] = np.minimum(votes + added, MOST_VOTES)
    return 0


def _sector(angle: Any, count: int) -> Any:
    share = angle / TURN
    share -= np.floor(share)
    return np.minimum((share * count).astype(np.int64), count - 1)
