"""A shortlist of many prints: those that may be of one print's finger, told from codes.

The neighbourhoods of all minutiae are coded once: in which cell of position and direction each
neighbour lies, in the minutia's own frame, and how the ridges run at places around it. Two minutiae
are compared by counting the codes that agree, and two prints by the pairs of minutiae that agree
and lie on one another under one rotation and shift. That takes a few hundredths of the time of a
whole comparison, so that these are needed for a small part of the prints alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.matching import _shortlist_kernel as kernel
from fpmatch.matching.rounding import ORIENTATIONS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prepare import PreparedTemplate
    from fpmatch.matching.prepared_many import PreparedMany

WORDS: Final = 12
"""Words of each kind that a minutia has."""

MOST_MINUTIAE: Final = 64
"""Minutiae of a probe that are looked up; of more, those of best quality."""

TURNS: Final = 256  # directions of a minutia told apart in a turn
BINS: Final = 16  # of ridge orientation, in half a turn


@dataclass(frozen=True, slots=True)
class ShortlistParameters:
    """Set how prints are coded and compared by their codes; lengths in pixels at 500 dpi.

    Parameters
    ----------
    cell_px : float
        Side of the cells in which neighbours lie.
    cells_from_middle : int
        Cells from a minutia to the border, beyond which a neighbour has no code.
    reach : float
        How far a neighbour may lie from the middle of its counterpart's cell, as a share of the
        tolerance of whole comparisons.
    max_turn_deg : float
        How far its direction may be from the middle of the cell.
    flow_rings : tuple of (int, float, float)
        Places of ridge orientation: how many, how far from the minutia, at what angle the first.
    flow_turn_deg : float
        How far an orientation may be from the middle of its counterpart's bin.
    most_pairs : int
        Pairs of minutiae that are laid on one another, those most alike.
    near_px, spread : float
        How far two pairs may be from one rotation and shift: so much, and so much more a pixel
        between them.
    pair_turn_deg : float
        How far their rotations may differ.
    """

    cell_px: float = 8.0
    cells_from_middle: int = 15
    reach: float = 0.7
    max_turn_deg: float = 20.0
    flow_rings: tuple[tuple[int, float, float], ...] = ((4, 24.0, 45.0), (8, 42.0, 22.5))
    flow_turn_deg: float = 12.0
    most_pairs: int = 16
    near_px: float = 9.0
    spread: float = 0.06
    pair_turn_deg: float = 15.0

    @property
    def most_turn(self) -> int:
        """Most difference of rotation, in steps of direction."""
        return round(self.pair_turn_deg * TURNS / 360)

    @property
    def places(self) -> NDArray[np.float64]:
        """Places of ridge orientation in a minutia's own frame, shape (2, WORDS)."""
        radius = np.concatenate([np.full(n, r) for n, r, _ in self.flow_rings])
        degrees = np.concatenate([a + 360 / n * np.arange(n) for n, _, a in self.flow_rings])
        angle = np.radians(degrees)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)])


@dataclass(frozen=True, eq=False)
class CodedPrints:
    """Hold the codes of many prints, and the prints.

    Parameters
    ----------
    prints : PreparedMany
        The prints, of M minutiae.
    turn : ndarray of uint8, shape (M,)
        Directions of the minutiae, in 256ths of a turn.
    around : ndarray of uint16, shape (M, 12)
        Cells of their neighbours.
    along : ndarray of uint8, shape (M, 12)
        Ridge orientations around them.
    parameters : ShortlistParameters
        How they were coded.
    """

    prints: PreparedMany
    turn: NDArray[np.uint8]
    around: NDArray[np.uint16]
    along: NDArray[np.uint8]
    parameters: ShortlistParameters

    @classmethod
    def of(cls, prints: PreparedMany, parameters: ShortlistParameters | None = None) -> CodedPrints:
        """Code prepared prints.

        Parameters
        ----------
        prints : PreparedMany
            The prints.
        parameters : ShortlistParameters, optional
            How (default: as measured).

        Returns
        -------
        CodedPrints
            Their codes, 37 bytes a minutia.

        Raises
        ------
        MatcherError
            If the prints keep more neighbours of a minutia than can be coded.
        """
        p = parameters or ShortlistParameters()
        if prints.neighbour.shape[1] > WORDS:
            raise MatcherError(f"more than {WORDS} neighbours of a minutia cannot be coded")
        turn = direction_codes(prints.direction)
        around = np.empty((len(turn), WORDS), np.uint16)
        along = np.empty((len(turn), WORDS), np.uint8)
        m = prints
        kernel.code_neighbours(
            *(m.minutiae_start, m.xy, m.direction, turn, m.count, m.neighbour),
            *(1.0 / p.cell_px, p.cells_from_middle, around),
        )
        kernel.code_flow(
            *(m.minutiae_start, m.xy, m.direction, turn, m.cell, m.cell_start, m.shape, m.step),
            *(m.has_flow, p.places, along),
        )
        return cls(prints, turn, around, along, p)

    def __len__(self) -> int:
        return len(self.prints)

    @property
    def nbytes(self) -> int:
        """Bytes of the codes."""
        return self.turn.nbytes + self.around.nbytes + self.along.nbytes

    def weights(
        self, probe: PreparedTemplate, first: int = 0, last: int | None = None
    ) -> NDArray[np.int32]:
        """Say how much speaks for each print being of the probe's finger.

        Parameters
        ----------
        probe : PreparedTemplate
            What `prepare` returned, with the usual parameters.
        first, last : int
            Those from `first` up to, not including, `last` (default: all).

        Returns
        -------
        ndarray of int32, shape (last - first,)
            0 where nothing does.
        """
        first, last, _ = slice(first, last).indices(len(self))
        found = np.zeros(max(last - first, 0), np.int32)
        m = self.prints
        sieve(probe, self.parameters).weigh(
            *(first, m.minutiae_start, m.xy, self.turn, self.around, self.along, m.has_flow),
            found,
        )
        return found

    def shortlist(self, probe: PreparedTemplate, count: int) -> NDArray[np.intp]:
        """Return the prints that most speaks for.

        Parameters
        ----------
        probe : PreparedTemplate
            What `prepare` returned, with the usual parameters.
        count : int
            How many.

        Returns
        -------
        ndarray of intp, shape (min(count, N),)
            Their numbers, ascending; of equals, the first.

        Examples
        --------
        >>> from fpmatch import Minutiae, Template
        >>> from fpmatch.matching.prepare import prepare
        >>> from fpmatch.matching.prepared_many import PreparedMany
        >>> near = Minutiae([50, 90, 60, 70, 85, 30], [40, 50, 80, 60, 90, 60], [0, 1, 2, 3, 4, 5])
        >>> far = Minutiae([20, 150, 60, 70, 9, 80], [40, 50, 80, 160, 90, 90], [3, 1, 0, 2, 5, 1])
        >>> prints = [prepare(Template(m, 200, 200)) for m in (far, near, far)]
        >>> coded = CodedPrints.of(PreparedMany.of(prints))
        >>> coded.shortlist(prints[1], 1).tolist()
        [1]
        """
        weight = self.weights(probe)
        if count >= len(weight):
            return np.arange(len(weight))
        order = np.argsort(-weight, kind="stable")
        return np.sort(order[: max(count, 0)])


def direction_codes(direction: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return directions, unit vectors of shape (M, 2), in 256ths of a turn."""
    angle = np.arctan2(direction[:, 1], direction[:, 0])
    return (np.rint(angle * (TURNS / (2 * np.pi))).astype(np.int32) % TURNS).astype(np.uint8)


def sieve(probe: PreparedTemplate, parameters: ShortlistParameters) -> kernel.Sieve:
    """Return the tables of a probe.

    Parameters
    ----------
    probe : PreparedTemplate
        What `prepare` returned, with the usual parameters.
    parameters : ShortlistParameters
        As the prints were coded with.

    Returns
    -------
    Sieve
        The kernel's, of 64 of its minutiae at most.
    """
    p = parameters
    best = np.sort(np.argsort(-probe.quality, kind="stable")[:MOST_MINUTIAE])
    xy = np.ascontiguousarray(probe.points[:2, best].T, np.float32)
    turn = direction_codes(np.ascontiguousarray(probe.points[2:, best].T, np.float32))
    n = probe.neighbourhoods
    return kernel.Sieve(
        np.minimum(n.count[best], WORDS),
        np.ascontiguousarray(n.frame[best]),
        xy,
        turn,
        _flow_around(probe, best, turn, p),
        (1.0 / p.cell_px, p.cells_from_middle),
        p.reach,
        math.cos(math.radians(p.max_turn_deg)),
        p.flow_turn_deg * BINS / 180,
        p,
    )


def _flow_around(
    probe: PreparedTemplate,
    best: NDArray[np.intp],
    turn: NDArray[np.uint8],
    p: ShortlistParameters,
) -> NDArray[np.float64]:
    """Return the ridge orientation around minutiae, in bins; -1 where it is not known."""
    region = probe.region
    x, y, c, s = probe.points[:, best, None]
    u, v = p.places
    x, y = x + c * u - s * v, y + s * u + c * v
    column = np.floor(x / region.step).astype(np.int64) - region.first_column
    row = np.floor(-y / region.step).astype(np.int64) - region.first_row
    rows, columns = region.code.shape
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    code = np.zeros(x.shape, np.int64)
    code[inside] = region.code[row[inside], column[inside]]
    known = (code > 0) & region.has_flow
    bins = (code - 1.0) * BINS / ORIENTATIONS - turn[:, None] * (2.0 * BINS / TURNS)
    return np.where(known, np.mod(bins, BINS), -1.0)
