"""Numpy form of `_local_kernel`: the local similarity of two prints' minutiae."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Numbers = NDArray[np.intp]

EIGHTHS: Final = 8
LEAST_PRECISION: Final = 1e-30


class NeighbourIndex:
    """The neighbours of one print's minutiae, sorted into cells, as the kernel's class has them."""

    def __init__(
        self,
        count: Any,
        frame: Any,
        side: float,
        half: int,
        max_turn: float,
        slack: float,
        other_size: int,
    ) -> None:
        count, given = np.asarray(count), np.asarray(frame)
        self.minutiae, _, self.size = given.shape
        self.half, self.per_px, self._slack = half, 1.0 / side, slack
        self._root_weight = given[:, 5].T.astype(np.float64).ravel()
        k, i = np.nonzero(np.arange(self.size)[:, None] < count)
        self.owner = i
        self._number = k * self.minutiae + i
        self.entry = given[i, :, k].astype(np.float64).reshape(len(i), 6).T.copy()
        angle = (np.arange(EIGHTHS) + 0.5) * (np.pi / 4)  # in the middle of each eighth
        least = np.cos(min(max_turn + np.pi / 8 + 1e-3, np.pi))
        c, s = np.cos(angle), np.sin(angle)
        middle = np.empty((2, EIGHTHS))
        middle[:, eighth(c, s)] = c, s
        self._list(self.entry[2:4].T @ middle >= least)

    def _list(self, in_reach: NDArray[np.bool_]) -> None:
        """List the entries in all cells within their reach, given the eighths within it."""
        u, v = self.entry[:2]
        reach = self._slack / np.sqrt(np.maximum(self.entry[4], LEAST_PRECISION)) * 1.001 + 0.01
        top, left = self._line(v - reach), self._line(u - reach)
        columns = self._line(u + reach) + 1 - left
        turns = in_reach.sum(axis=1)
        cells = (self._line(v + reach) + 1 - top) * columns * turns
        entry, place = spread_out(cells)
        place, turn = np.divmod(place, turns[entry])
        row, column = np.divmod(place, columns[entry])
        turn = np.argsort(~in_reach, axis=1, kind="stable")[entry, turn]
        cell = (top[entry] + row) * 2 * self.half + left[entry] + column
        cell = cell * EIGHTHS + turn
        self.item = entry[np.argsort(cell, kind="stable")]
        listed = np.bincount(cell, minlength=4 * self.half**2 * EIGHTHS)
        self.start = np.concatenate([[0], np.cumsum(listed)])

    def _line(self, place: Floats) -> Numbers:
        """Return the rows or columns of cells of coordinates."""
        place = np.minimum(place * self.per_px + self.half, 2 * self.half - 1)
        return np.where(place > 0.0, place, 0.0).astype(np.intp)

    def _meetings(self, neighbours: Floats) -> tuple[Numbers, Numbers]:
        """Return which neighbours, columns of (6, N), and which entries may be similar."""
        u, v, c, s = neighbours[:4]
        cell = (self._line(v) * 2 * self.half + self._line(u)) * EIGHTHS + eighth(c, s)
        which, place = spread_out(self.start[cell + 1] - self.start[cell])
        return which, self.item[self.start[cell][which] + place]

    def to_prints_before(
        self, count: Any, frame: Any, minutiae: int, min_cosine: float, similarity: Any
    ) -> int:
        """Fill ``similarity[i, j]`` for the minutiae i of another print A and j of this one."""
        owner, k, neighbours = neighbours_of(count, frame, minutiae)
        which, e = self._meetings(neighbours)
        seen, entry = neighbours[:, which], self.entry[:, e]
        near = _agreement(entry, seen, seen[4], min_cosine) * entry[5]
        size = np.asarray(frame).shape[2]
        best = np.zeros((size, minutiae, self.minutiae))
        keep_greatest(best, (k[which], owner[which], self.owner[e]), near)
        weight = np.zeros((size, minutiae))
        weight[k, owner] = neighbours[5]
        total = np.zeros((minutiae, self.minutiae))
        for row in range(size):
            total += best[row] * weight[row, :, None]
        np.asarray(similarity)[:minutiae, : self.minutiae] = total
        return 0

    def to_prints_after(
        self, count: Any, frame: Any, minutiae: int, min_cosine: float, similarity: Any
    ) -> int:
        """Fill ``similarity[i, j]`` for the minutiae i of this print and j of another one, B."""
        owner, _, neighbours = neighbours_of(count, frame, minutiae)
        which, e = self._meetings(neighbours)
        seen, entry = neighbours[:, which], self.entry[:, e]
        near = _agreement(entry, seen, entry[4], min_cosine) * seen[5]
        best = np.zeros((minutiae, self.size * self.minutiae))
        keep_greatest(best, (owner[which], self._number[e]), near)
        best *= self._root_weight
        best = best.reshape(minutiae, self.size, self.minutiae)
        total = np.zeros((minutiae, self.minutiae))
        for k in range(self.size):
            total += best[:, k]
        np.asarray(similarity)[: self.minutiae, :minutiae] = total.T
        return 0


def neighbours_of(count: Any, frame: Any, minutiae: int) -> tuple[Numbers, Numbers, Floats]:
    """Return whose each neighbour is, its place among them, and the neighbours, shape (6, N)."""
    given = np.asarray(frame)[:minutiae]
    owner, k = np.nonzero(np.arange(given.shape[2]) < np.asarray(count)[:minutiae, None])
    return owner, k, given[owner, :, k].astype(np.float64).T.copy()


def spread_out(length: Numbers) -> tuple[Numbers, Numbers]:
    """Return the number of the run, and the place in it, of each entry of runs so long."""
    run = np.repeat(np.arange(len(length)), length)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(length) - length, length)


def keep_greatest(best: Floats, place: tuple[Numbers, ...], value: Floats) -> None:
    """Raise entries of `best` to the greatest of the values that belong there."""
    above = np.flatnonzero(value > 0.0)
    np.maximum.at(best, tuple(axis[above] for axis in place), value[above])


def eighth(c: Floats, s: Floats) -> Numbers:
    """Return the numbers of the eighths of the turn that contain directions."""
    number: Numbers = (c < 0.0) + 2 * (s < 0.0) + 4 * (np.abs(s) > np.abs(c))
    return number


def _agreement(entry: Floats, seen: Floats, precision: Floats, min_cosine: float) -> Floats:
    """Return the product of the agreements of neighbours with entries in position and direction."""
    du, dv = seen[0] - entry[0], seen[1] - entry[1]
    near = 1.0 - (du * du + dv * dv) * precision
    turn = (seen[2] * entry[2] + seen[3] * entry[3] - min_cosine) * (0.25 / (1.0 - min_cosine))
    agreement: Floats = (near + np.abs(near)) * (turn + np.abs(turn))
    return agreement


def normalize_by_size(
    similarity: Any, count_a: Any, minutiae_a: int, count_b: Any, minutiae_b: int, fewest: int
) -> int:
    """Divide by the geometric mean of the neighbourhoods' sizes, each at least `fewest`."""
    given = np.asarray(similarity)[:minutiae_a, :minutiae_b]
    a, b = (
        1.0 / np.sqrt(np.maximum(np.asarray(count)[:minutiae], fewest).astype(np.float64))
        for count, minutiae in ((count_a, minutiae_a), (count_b, minutiae_b))
    )
    given[:] = given.astype(np.float64) * (a[:, None] * b)
    return 0
