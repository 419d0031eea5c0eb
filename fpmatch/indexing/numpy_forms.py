"""Numpy forms of `_term_kernel` and `_vote_kernel`, for where these are not compiled."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

TURN: Final = 6.283185307179586
LENGTH_ERROR_PX: Final = 2.5
GROWTH: Final = 0.03
WIDTH: Final = 1.7
LENGTHS: Final = 21
SECTORS: Final = 36
ROTATIONS: Final = 64
PLACES: Final = 32
PER_PX: Final = 0.125
SHAPE: Final = (4, 16, 4)  # cells of shifts along x, of rotation, of shifts along y
CELLS: Final = 256
MOST: Final = 63


def describe_edges(points: Any, edge: Any, term: Any, pose: Any) -> int:
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
    term[:] = cell
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
    rotation: Any,
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
    found, of = np.asarray(posting)[at].astype(np.int64), np.asarray(reading)[q]
    turn = ((found >> 10) - np.asarray(rotation)[of]) & (ROTATIONS - 1)
    place = np.asarray(shift)[of, turn].astype(np.int64)
    x, y = (found >> 5) - (place >> 5), found - place
    cell = (x << 3 & 192) + (turn & 60) + (y >> 3 & 3)
    counted = np.bincount((found >> 16) * CELLS + cell, np.asarray(weight)[q], len(votes) * CELLS)
    cells = np.minimum(counted, MOST).astype(np.uint8).reshape(-1, *SHAPE)
    cells += np.roll(cells, -1, 1)
    cells += np.roll(cells, -1, 2)
    best = cells.reshape(-1, CELLS).max(1, initial=0).astype(np.uint32)
    votes[:] = best * np.asarray(factor) >> 2
    return 0


def lists_ascend(start: Any, posting: Any, prints: int) -> bool:
    """Return whether the prints of each list ascend, and are among so many, as the kernel does."""
    of = np.asarray(posting) >> 16
    falls = np.flatnonzero(of[1:] < of[:-1]) + 1  # only where another list begins
    return bool((of < prints).all() and np.isin(falls, start).all())


def _sector(angle: Any, count: int) -> Any:
    share = angle / TURN
    share -= np.floor(share)
    return np.minimum((share * count).astype(np.int64), count - 1)
