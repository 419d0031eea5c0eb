"""Cells: pairs of neighbours of a minutia as integers, equal in most prints of one finger.

The neighbours are those of the Delaunay triangulation that all of fpmatch compares. A pair of them
has six measures in the frame of the minutia: distance, angle and relative direction of each. They
are put into several grids, each shifted against the others, so that what lies near a border in one
grid lies within a cell in another.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate

MINUTIAE: Final = 48  # of a print; of more, those of best quality
NEIGHBOURS: Final = 12  # of a minutia, at most
GRIDS: Final = 4
PAIRS: Final = NEIGHBOURS * (NEIGHBOURS - 1) // 2  # of neighbours of a minutia, at most
REACH_PX: Final = 160.0  # of neighbours, at 500 dpi
FIRST_PX: Final = 4.0  # distance at which the cells of distance begin
RATIO: Final = 0.25  # logarithm of the ratio of distances at the ends of a cell
DISTANCES: Final = math.ceil(math.log(REACH_PX / FIRST_PX) / RATIO) + 1  # cells of distance
SECTORS: Final = 25  # of the angle at which a neighbour lies, in a turn
DIRECTION_SECTORS: Final = 14  # of the relative direction of a neighbour, in a turn
_TURN: Final = 2 * math.pi
_GOLDEN: Final = 1.1347241384015194  # the positive root of x**7 = x + 1


def pair_cells(prepared: PreparedTemplate) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the different cells of a print, and for each the minutia it was first found at.

    Minutiae are numbered by descending quality.
    """
    order = np.argsort(-prepared.quality, kind="stable")[:MINUTIAE]
    count = prepared.neighbourhoods.count[order]
    u, v, c, s = prepared.neighbourhoods.frame[order, :4].astype(np.float64).transpose(1, 0, 2)
    distance = np.hypot(u, v)
    angle, turn = np.arctan2(v, u) % _TURN, np.arctan2(s, c) % _TURN
    near = (np.arange(u.shape[1]) < count[:, None]) & (distance < REACH_PX)
    around = np.argsort(np.where(near, angle, np.inf), axis=1, kind="stable")
    log = np.log(np.maximum(distance, FIRST_PX) / FIRST_PX) / RATIO
    log, angle, turn, near = (np.take_along_axis(a, around, 1) for a in (log, angle, turn, near))
    first, second = np.triu_indices(u.shape[1], 1)
    there = near[:, first] & near[:, second]
    grids = []
    for grid in range(GRIDS):
        code = np.full(there.shape, grid, np.int64)
        shifts = [((grid + 1) / _GOLDEN ** (k + 1)) % 1.0 for k in range(6)]
        for one, at in ((first, shifts[:3]), (second, shifts[3:])):
            code = code * DISTANCES + np.floor(log + at[0]).astype(np.int64)[:, one]
            code = code * SECTORS + _sector(angle, SECTORS, at[1])[:, one]
            code = code * DIRECTION_SECTORS + _sector(turn, DIRECTION_SECTORS, at[2])[:, one]
        grids.append(code[there])
    cells, place = np.unique(np.concatenate(grids), return_index=True)
    return cells, np.tile(there.nonzero()[0], GRIDS)[place]


def _sector(angle: NDArray[np.float64], sectors: int, shift: float) -> NDArray[np.int64]:
    """Return in which of the sectors of a turn angles lie, the first one turned by a shift."""
    return np.floor(angle / _TURN * sectors + shift).astype(np.int64) % sectors
