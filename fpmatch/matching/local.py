"""Local match: which minutiae of one print have a neighbourhood like which of the other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching import _local_kernel as kernel

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
        Neighbourhoods of fewer are taken for as large as this, so that few do not agree easily.
    seeds : int
        Most alike pairs of minutiae that are handed on.
    """

    max_turn_deg: float = 30.0
    fewest_neighbours: int = 4
    seeds: int = 24


def local_likeness(
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
    likeness = np.empty((len(a.count), len(b.count)), np.float32)
    kernel.neighbourhood_likeness(
        a.count, a.frame, b.count, b.frame, math.cos(math.radians(p.max_turn_deg)), likeness
    )
    size_a = np.maximum(a.count, p.fewest_neighbours).astype(np.float32)
    size_b = np.maximum(b.count, p.fewest_neighbours).astype(np.float32)
    likeness /= np.sqrt(size_a[:, None] * size_b)
    return likeness


def most_alike(
    likeness: NDArray[np.float32], parameters: LocalParameters | None = None
) -> NDArray[np.int32]:
    """Return the pairs (i, j) of greatest likeness, best first, ties by index; shape (K, 2)."""
    p = parameters or LocalParameters()
    order = np.argsort(-likeness.ravel(), kind="stable")[: p.seeds]
    order = order[likeness.ravel()[order] > 0]
    return np.column_stack(np.divmod(order, likeness.shape[1])).astype(np.int32)
