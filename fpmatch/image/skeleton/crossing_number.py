"""Crossing number: endings and bifurcations of a skeleton, and the branches from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.image.skeleton import _trace_kernel as kernel
from fpmatch.image.skeleton.thin import bordered, crossing_number_table

if TYPE_CHECKING:
    from numpy.typing import NDArray

# (dy, dx) of the neighbours: east, north, west, south, then the corners between them.
_STEP: Final = np.array(
    [[0, 1], [-1, 0], [0, -1], [1, 0], [-1, 1], [-1, -1], [1, -1], [1, 1]], np.int32
)
_MAX_BRANCHES: Final = 4


@dataclass(frozen=True, slots=True)
class SkeletonNodes:
    """Hold the nodes of a skeleton and the beginnings of their branches.

    Parameters
    ----------
    y, x : ndarray of int32, shape (N,)
        Pixels of the nodes.
    crossing_number : ndarray of uint8, shape (N,)
        Half the number of changes around the pixel (Rutovitz 1966): 1 for an ending, 3 for a
        bifurcation, 4 for a crossing.
    paths : ndarray of int32, shape (N, 4, L, 2)
        Pixels (y, x) of up to four branches, from the node outwards.
    steps : ndarray of int32, shape (N, 4)
        Number of traced pixels of each branch, at most L.
    target : ndarray of int32, shape (N, 4)
        The node that ends the branch, or -1 where the trace met none.
    """

    y: NDArray[np.int32]
    x: NDArray[np.int32]
    crossing_number: NDArray[np.uint8]
    paths: NDArray[np.int32]
    steps: NDArray[np.int32]
    target: NDArray[np.int32]


def find_nodes(skeleton: NDArray[np.bool_], branch_px: int) -> SkeletonNodes:
    """Find the endings, bifurcations and crossings of a skeleton and trace their branches.

    Each branch is traced for at most `branch_px` pixels. Nodes are in raster order.
    """
    padded = bordered(skeleton)
    pixels = np.flatnonzero(padded.view(np.bool_)).astype(np.int32)
    yx = np.empty((len(pixels), 2), np.int32)
    number = np.empty(len(pixels), np.uint8)
    count = kernel.list_nodes(padded, pixels, crossing_number_table(), yx, number)
    nodes = yx[:count].copy()
    padded[nodes[:, 0], nodes[:, 1]] = 2
    paths = np.zeros((count, _MAX_BRANCHES, branch_px, 2), np.int32)
    steps = np.zeros((count, _MAX_BRANCHES), np.int32)
    target = np.full((count, _MAX_BRANCHES), -1, np.int32)
    if branch_px > 0:
        kernel.trace_branches(padded, nodes, _STEP, paths, steps, target)
    return SkeletonNodes(
        y=nodes[:, 0] - 1,
        x=nodes[:, 1] - 1,
        crossing_number=number[:count].copy(),
        paths=paths,
        steps=steps,
        target=target,
    )
