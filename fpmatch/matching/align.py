"""Global match: the transform that lays one print over the other, and the pairs under it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching import _align_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class AlignmentParameters:
    """Set the global match; lengths in pixels at 500 dpi.

    Parameters
    ----------
    max_turn_deg : float
        Largest difference in direction within a pair.
    seed_reach_px, seed_reach_per_px, seed_reach_limit_px : float
        Reach of the pairing under a seed's own transform: at the seed, its growth with distance
        from it, and its limit.
    first_seeds : int
        Seeds that are looked at first, and most often alone.
    candidates : int
        Seeds whose transforms are refined to the end.
    rigid_rounds, rigid_reach_px : int, float
        Rounds of refitting the similarity transform, at least one, and the reach of their pairing.
    bend_rounds, bend_sigma_px : int, float
        Rounds of bending with the skin, and the width over which it is taken to bend alike.
    bend_reach_px, bend_reach_per_px, bend_reach_limit_px : float
        Reach of the pairing while bending: beside another pair, its growth with the distance from
        the nearest other pair, and its limit.
    """

    max_turn_deg: float = 30.0
    seed_reach_px: float = 9.0
    seed_reach_per_px: float = 0.08
    seed_reach_limit_px: float = 22.0
    first_seeds: int = 8
    candidates: int = 4
    rigid_rounds: int = 2
    rigid_reach_px: float = 16.0
    bend_rounds: int = 2
    bend_sigma_px: float = 45.0
    bend_reach_px: float = 8.0
    bend_reach_per_px: float = 0.08
    bend_reach_limit_px: float = 18.0

    @property
    def min_cosine(self) -> float:
        """Cosine of the largest difference in direction."""
        return math.cos(math.radians(self.max_turn_deg))


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Hold how print A lies on print B; minutiae are columns (x, y up, direction c, s).

    Parameters
    ----------
    transform : ndarray of float64, shape (4,)
        (s·cos θ, s·sin θ, tx, ty) at 500 dpi with y pointing up.
    partner : ndarray of int32, shape (N,)
        For each minutia of A its partner in B, or -1; one-to-one.
    weight : ndarray of float64, shape (N,)
        How well a pair fits, 0 to 1; 0 where there is none.
    bent : ndarray of float64, shape (4, N)
        The minutiae of A, moved onto B and bent with the skin.
    """

    transform: NDArray[np.float64]
    partner: NDArray[np.int32]
    weight: NDArray[np.float64]
    bent: NDArray[np.float64]


def at_rest(a: NDArray[np.float64]) -> Alignment:
    """Return the alignment of a print, minutiae (4, N), with itself: each is its own partner."""
    n = a.shape[1]
    return Alignment(np.array([1.0, 0.0, 0.0, 0.0]), np.arange(n, dtype=np.int32), np.ones(n), a)


def light_table(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    parameters: AlignmentParameters | None = None,
    seeds: int = 0,
) -> kernel.LightTable:
    """Return a table on which print A is laid over print B.

    Parameters
    ----------
    a, b : ndarray of float64, shapes (4, N) and (4, M)
        x and y in pixels at 500 dpi, y pointing up, and the unit vector of the direction.
    parameters : AlignmentParameters, optional
        Reaches and rounds.
    seeds : int
        The most seeds there is to be room for.

    Returns
    -------
    LightTable
        For one thread.
    """
    table = kernel.LightTable(a.shape[1], b.shape[1], seeds, parameters or AlignmentParameters())
    table.put_a(a, a.shape[1])
    table.put_b(b, b.shape[1])
    return table


def kept(table: kernel.LightTable) -> Alignment:
    """Return the alignment that a table has kept."""
    n = table.size_a
    return Alignment(
        np.array([table.best_c, table.best_s, table.best_x, table.best_y]),
        np.array(table.best_partner[:n]),
        np.array(table.best_weight[:n]),
        np.array(table.best_bent[:, :n]),
    )


def candidates(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    seeds: NDArray[np.int32],
    parameters: AlignmentParameters | None = None,
) -> list[Alignment]:
    """Lay print A on print B in the ways that pairs of minutiae that look alike propose.

    Every seed proposes a transform; those with the most support are refitted and re-paired in
    turn, at first as a similarity transform, then bending smoothly with the skin. Of those that
    begin with the same pairs only the first is.

    Parameters
    ----------
    a, b : ndarray of float64, shapes (4, N) and (4, M)
        x and y in pixels at 500 dpi, y pointing up, and the unit vector of the direction.
    seeds : ndarray of int32, shape (K, 2)
        Pairs of minutiae whose neighbourhoods are alike, best first.
    parameters : AlignmentParameters, optional
        Reaches and rounds.

    Returns
    -------
    list of Alignment
        Those under which anything is paired; the one of most support first.
    """
    if not len(seeds):
        return []
    table = light_table(a, b, parameters, len(seeds))
    found = []
    for k in range(table.propose(seeds, len(seeds))):
        table.take(k)
        if table.keep() > 0:
            found.append(kept(table))
    return found


def sketches(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    seeds: NDArray[np.int32],
    parameters: AlignmentParameters | None = None,
) -> list[Alignment]:
    """Lay print A on print B, rigidly and at once, in the ways that the first seeds propose.

    Parameters
    ----------
    a, b, seeds, parameters
        As for `candidates`.

    Returns
    -------
    list of Alignment
        Those under which anything is paired; the one of most support first.
    """
    p = parameters or AlignmentParameters()
    table = light_table(a, b, p, len(seeds))
    found = []
    for k in range(table.propose(seeds, min(p.first_seeds, len(seeds)))):
        table.sketch(k)
        if table.keep() > 0:
            found.append(kept(table))
    return found
