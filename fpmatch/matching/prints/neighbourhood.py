"""Neighbourhoods: what surrounds each minutia on the Delaunay triangulation.

The paper compares whole one-rings of points. So that a neighbourhood is recognised although
neighbours are missing or spurious, each neighbour is kept by itself, with its shape-preserving
weight (eq. 4) and its position and direction in the frame of the minutia's own direction; points
of the second ring make up the number.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.prints._kernels import _neighbourhood_kernel as kernel
from fpmatch.matching.prints.prepared import Neighbourhoods
from fpmatch.pointset.delaunay.triangulate import triangulate_checked

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


def neighbourhoods(
    points: NDArray[np.float64],
    parameters: MatchParameters | None = None,
    start: Sequence[int] | None = None,
) -> Neighbourhoods:
    """Describe the neighbourhood of every minutia; `points` are as `PreparedTemplate` has them.

    They may be those of many prints, each from an entry of `start` up to the next; neighbours are
    numbered from the print's first minutia.
    """
    p = parameters or USUAL
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
