"""Local match: how similar the neighbourhoods of the minutiae of two prints are."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.neighbourhood import NeighbourhoodParameters
from fpmatch.matching.pipeline._kernels import _local_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.neighbourhood import Neighbourhoods

CELL_PX: Final = 20.0  # side of the cells in which neighbours are looked up
HALF: Final = 7  # such cells from the middle to each border; both set the time it takes, no more


@dataclass(frozen=True, slots=True)
class LocalParameters:
    """Set the local match."""

    max_turn_deg: float = 30.0  # between the relative directions of a neighbour and its counterpart
    fewest_neighbours: int = 4  # fewer count as this many, so that few do not agree easily

    @property
    def min_cosine(self) -> float:
        """Cosine of the largest difference in direction."""
        return math.cos(math.radians(self.max_turn_deg))


def local_similarity(
    a: Neighbourhoods, b: Neighbourhoods, parameters: LocalParameters | None = None
) -> NDArray[np.float32]:
    """Compare every neighbourhood of A, N of them, with every neighbourhood of B, M of them.

    Returns
    -------
    ndarray of float32, shape (N, M)
        Weighted share of neighbours that have a counterpart: 0 for none, about 1 for all.
    """
    p = parameters or LocalParameters()
    similarity = np.empty((len(a.count), len(b.count)), np.float32)
    index_neighbours(a, p).to_prints_after(b.count, b.frame, len(b.count), p.min_cosine, similarity)
    kernel.normalize_by_size(
        similarity, a.count, len(a.count), b.count, len(b.count), p.fewest_neighbours
    )
    return similarity


def index_neighbours(
    neighbourhoods: Neighbourhoods, parameters: LocalParameters | None = None
) -> kernel.NeighbourIndex:
    """Sort the neighbours of one print's minutiae so that similar ones are found at once.

    The prints that it is compared with have the usual tolerances.
    """
    turn = math.radians((parameters or LocalParameters()).max_turn_deg)
    slack = 1.0 / (1.0 - NeighbourhoodParameters().tolerance_per_px)
    of = neighbourhoods.count, neighbourhoods.frame
    cells = CELL_PX, HALF, turn, slack, of[1].shape[2]
    index: kernel.NeighbourIndex = kernel.NeighbourIndex(*of, *cells)
    return index
