"""Local match: how similar the neighbourhoods of the minutiae of two prints are."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching import _local_kernel as kernel
from fpmatch.matching.neighbourhood import NeighbourhoodParameters

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.neighbourhood import Neighbourhoods


@dataclass(frozen=True, slots=True)
class LocalParameters:
    """Set the local match.

    Parameters
    ----------
    max_turn_deg : float
        Largest difference in relative direction between a neighbour and its counterpart.
    fewest_neighbours : int
        Neighbourhoods of fewer count as this large, so that few do not agree easily.
    cell_px, cells_reach_px : float
        Side of the cells in which neighbours are looked up, and how far from a minutia they reach.
        They set the time that it takes, and nothing else.
    """

    max_turn_deg: float = 30.0
    fewest_neighbours: int = 4
    cell_px: float = 20.0
    cells_reach_px: float = 128.0

    @property
    def min_cosine(self) -> float:
        """Cosine of the largest difference in direction."""
        return math.cos(math.radians(self.max_turn_deg))


def local_similarity(
    a: Neighbourhoods, b: Neighbourhoods, parameters: LocalParameters | None = None
) -> NDArray[np.float32]:
    """Compare every neighbourhood of A with every neighbourhood of B.

    Parameters
    ----------
    a, b : Neighbourhoods
        Of N and M minutiae.
    parameters : LocalParameters, optional
        Tolerances.

    Returns
    -------
    ndarray of float32, shape (N, M)
        Weighted share of neighbours that have a counterpart: 0 for none, about 1 for all.
    """
    p = parameters or LocalParameters()
    similarity = np.empty((len(a.count), len(b.count)), np.float32)
    index = index_neighbours(a, p)
    index.to_prints_after(b.count, b.frame, len(b.count), p.min_cosine, similarity)
    kernel.normalize_by_size(
        similarity, a.count, len(a.count), b.count, len(b.count), p.fewest_neighbours
    )
    return similarity


def index_neighbours(
    neighbourhoods: Neighbourhoods, parameters: LocalParameters | None = None
) -> kernel.NeighbourIndex:
    """Sort the neighbours of one print's minutiae so that similar ones are found at once.

    Parameters
    ----------
    neighbourhoods : Neighbourhoods
        Of the print that is compared with others, which have the usual tolerances.
    parameters : LocalParameters, optional
        Tolerances, and the size of the cells.

    Returns
    -------
    NeighbourIndex
        The kernel's; what it finds does not depend on its cells.
    """
    p = parameters or LocalParameters()
    slack = 1.0 / (1.0 - NeighbourhoodParameters().tolerance_per_px)
    half = math.ceil(p.cells_reach_px / p.cell_px)
    n = neighbourhoods
    index: kernel.NeighbourIndex = kernel.NeighbourIndex(
        n.count, n.frame, p.cell_px, half, math.radians(p.max_turn_deg), slack, n.frame.shape[2]
    )
    return index
