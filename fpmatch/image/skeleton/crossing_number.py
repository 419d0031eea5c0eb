"""Crossing number: endings and bifurcations of a skeleton, and the branches from them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.image.skeleton import _trace_kernel as kernel
from fpmatch.image.skeleton.thin import bordered, crossing_number_table, neighbour_code

if TYPE_CHECKING:
    from fpmatch.image.preprocess.arrays import Grey, Ints, Mask

# (dy, dx) of the neighbours: east, north, west, south, then the corners between them.
_STEP: Final = np.array(
    [[0, 1], [-1, 0], [0, -1], [1, 0], [-1, 1], [-1, -1], [1, -1], [1, 1]], np.int32
)
_MAX_BRANCHES: Final = 4


class SkeletonNodes(NamedTuple):
    """The N nodes of a skeleton and the beginnings of up to four branches of each."""

    y: Ints  # pixels of the nodes, (N,)
    x: Ints
    crossing_number: Grey  # (N,): 1 for an ending, 3 for a bifurcation, 4 for a crossing
    paths: Ints  # (y, x) of the branches' pixels from the node on, (N, 4, L, 2)
    steps: Ints  # number of traced pixels of each branch, at most L, (N, 4)
    target: Ints  # node that ends the branch, -1 if the trace met none, (N, 4)


def find_nodes(skeleton: Mask, branch_px: int) -> SkeletonNodes:
    """Find the nodes of a skeleton in raster order; trace `branch_px` pixels of their branches."""
    padded = bordered(skeleton)
    list_nodes = nodes_with_kernel if kernel.COMPILED else nodes_with_numpy
    nodes, number = list_nodes(padded)
    count = len(nodes)
    y, x = nodes.T
    labels = padded.astype(np.int32)
    labels[y, x] = np.arange(2, 2 + count)
    paths = np.zeros((count, _MAX_BRANCHES, branch_px, 2), np.int32)
    steps = np.zeros((count, _MAX_BRANCHES), np.int32)
    target = np.full((count, _MAX_BRANCHES), -1, np.int32)
    if branch_px > 0:
        traced: list[Any] = [labels, nodes, _STEP, paths, steps, target]
        if not kernel.COMPILED:  # single elements are read faster so
            traced = [memoryview(array) for array in traced]
        kernel.trace_branches(*traced)
    return SkeletonNodes(y - 1, x - 1, number, paths, steps, target)


def nodes_with_kernel(padded: Grey) -> tuple[Ints, Grey]:
    """Return (y, x) and crossing numbers of the nodes of a skeleton with a border of zeros."""
    pixels = np.flatnonzero(padded.view(np.bool_)).astype(np.int32)
    yx = np.empty((len(pixels), 2), np.int32)
    number = np.empty(len(pixels), np.uint8)
    count = kernel.list_nodes(padded, pixels, crossing_number_table(), yx, number)
    return yx[:count].copy(), number[:count].copy()


def nodes_with_numpy(padded: Grey) -> tuple[Ints, Grey]:
    """Return what `nodes_with_kernel` does: the uncompiled path, and the kernel's oracle."""
    y, x = padded.nonzero()
    number = crossing_number_table()[neighbour_code(padded)[y, x]]
    chosen = (number == 1) | (number > 2)
    return np.stack([y[chosen], x[chosen]], axis=1).astype(np.int32), number[chosen]
