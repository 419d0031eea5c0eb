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
GRIDS: Final = (0, 4)
MOST: Final = 250


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
    cursor: Any,
    table: Any,
    votes: Any,
) -> int:
    """Fill `votes` with the most votes of each print in one window, as the kernel does."""
    start, term = np.asarray(start).astype(np.int64), np.asarray(term)
    length = start[term + 1] - start[term]
    q = np.repeat(np.arange(len(term)), length)
    at = np.arange(len(q)) + np.repeat(start[term] - (np.cumsum(length) - length), length)
    found, of = np.asarray(posting)[at].astype(np.int64), np.asarray(reading)[q]
    turn = ((found >> 10) - np.asarray(rotation)[of]) & (ROTATIONS - 1)
    place = np.asarray(shift)[of, turn].astype(np.int64)
    x, y = (found >> 5) - (place >> 5), found - place
    votes[:] = 0
    weights = np.asarray(weight)[q]
    for half in GRIDS:
        window = ((turn + half) >> 3 & 7) << 4
        window += (((x + half) >> 1) & 12) + (((y + half) >> 3) & 3)
        key, sum_of = np.unique((found >> 16) * 128 + window, return_inverse=True)
        sums = np.minimum(np.bincount(sum_of.ravel(), weights), MOST).astype(np.uint8)
        np.maximum.at(votes, key >> 7, sums)
    return 0


def _sector(angle: Any, count: int) -> Any:
    share = angle / TURN
    share -= np.floor(share)
    return np.minimum((share * count).astype(np.int64), count - 1)
