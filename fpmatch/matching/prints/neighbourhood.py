"""Neighbourhoods: what surrounds each minutia on the Delaunay triangulation.

The paper compares whole one-rings of points. So that a neighbourhood is recognised although
neighbours are missing or spurious, each neighbour is kept by itself, with its shape-preserving
weight (eq. 4) and its position and direction in the frame of the minutia's own direction; points
of the second ring make up the number.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.parameters import parameter
from fpmatch.matching.prints._kernels import _neighbourhood_kernel as kernel
from fpmatch.matching.prints._kernels._preparation_kernel import round_weights
from fpmatch.pointset.delaunay.triangulate import triangulate_checked

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

ROOT_WEIGHTS: Final = np.arange(256) / 100.0  # of a neighbour; greater ones hardly occur


@dataclass(frozen=True, slots=True)
class NeighbourhoodParameters:
    """Neighbourhoods of the minutiae, with the shape-preserving weights of eq. (4)."""

    neighbours: int = parameter(
        12, "neighbours of a minutia, nearest first, from its first and second ring", 1, 32
    )
    tolerance_px: float = parameter(
        9.0, "how far a neighbour may lie from its counterpart", 0.1, 100
    )
    tolerance_per_px: float = parameter(
        0.08, "what a px of the neighbour's own distance adds to it", 0, 0.5
    )
    second_ring_weight: float = parameter(
        0.5, "weight of neighbours beyond the one-ring, the least in it; the mean is 1", 0, 1
    )


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhoods:
    """The neighbourhoods of N minutiae as flat arrays.

    In the frame of a minutia its direction is +u. A neighbour has its position u, v, its direction
    c, s, 1/tolerance² and its weight.
    """

    count: NDArray[np.int32]  # (N,): neighbours kept of each minutia
    neighbour: NDArray[np.int32]  # (N, size): which minutiae; beyond the number kept, any
    frame: NDArray[np.float32]  # (N, 6, size): the neighbours in the frame of the minutia


def neighbourhoods(
    points: NDArray[np.float64],
    parameters: NeighbourhoodParameters | None = None,
    start: Sequence[int] | None = None,
) -> Neighbourhoods:
    """Describe the neighbourhood of every minutia; `points` are as `PreparedTemplate` has them.

    They may be those of many prints, each from an entry of `start` up to the next; neighbours are
    numbered from the print's first minutia.
    """
    p = parameters or NeighbourhoodParameters()
    n = points.shape[1]
    starts = (0, n) if start is None else start
    count = np.empty(n, np.int32)
    neighbour = np.zeros((n, p.neighbours), np.int32)
    frame = np.zeros((n, 6, p.neighbours), np.float32)
    most = max((end - first for first, end in pairwise(starts)), default=0)
    writer = kernel.NeighbourhoodWriter(points, p, most, count, neighbour, frame)
    for first, end in pairwise(starts):
        mesh = triangulate_checked(points[:2, first:end].T.copy())
        closed = mesh.interior.view(np.uint8)
        writer.write(first, mesh.edges, mesh.ring_start, mesh.ring, closed)
    return Neighbourhoods(count, neighbour, frame)


def rounded(given: Neighbourhoods) -> Neighbourhoods:
    """Return neighbourhoods whose weights are rounded so that a byte keeps each of them.

    They are rounded when a print is prepared, not when it is put into arrays: so all comparisons,
    of two prints or of one with many, are of the same values.
    """
    frame = given.frame.copy()
    n, _, size = frame.shape
    round_weights(frame[:, 5], np.empty((n, size), np.uint8))
    return Neighbourhoods(given.count, given.neighbour, frame)


def root_weight_codes(root_weight: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return which of `ROOT_WEIGHTS` the square roots of neighbours' weights are nearest to."""
    code = np.empty(root_weight.shape, np.uint8)
    round_weights(root_weight.copy().reshape(-1, 1), code.reshape(-1, 1))
    return code
