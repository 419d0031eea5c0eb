"""Minutiae of a skeleton: its nodes, their direction and quality, and which are spurious.

Spurious minutiae are structures of the skeleton that the finger does not have.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import cv2
import numpy as np

from fpmatch.image.skeleton import _trace_kernel as kernel
from fpmatch.image.skeleton.thin import CROSSING_NUMBER, neighbour_bytes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.preprocess.arrays import Floats, Grey, Ints, Mask

# (dy, dx) of the neighbours: east, north, west, south, then the corners between them.
_STEP: Final = np.array(
    [[0, 1], [-1, 0], [0, -1], [1, 0], [-1, 1], [-1, -1], [1, -1], [1, 1]], np.int32
)
_MAX_BRANCHES: Final = 4

# Lengths in pixels at 500 dpi.
MAX_SPUR_PX: Final = 8
MAX_ISLAND_PX: Final = 14
MAX_BRIDGE_PX: Final = 8
MIN_MASK_DISTANCE_PX: Final = 6.0
MIN_BORDER_DISTANCE_PX: Final = 4.0
CROWDED_PX: Final = 6.0
BROKEN_PX: Final = 10.0
BROKEN_ANGLE_DEG: Final = 50.0
DIRECTION_PX: Final = 14
BRANCH_PX: Final = max(DIRECTION_PX, MAX_BRIDGE_PX)  # of the branches that both need
RADIUS_PX: Final = 14  # of the neighbourhood that quality is measured in
SIGMA_PX: Final = 8.0


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
    padded = np.pad(np.asarray(skeleton, bool), 1).view(np.uint8)
    pixels = np.flatnonzero(padded.view(np.bool_))
    number = CROSSING_NUMBER[neighbour_bytes(padded, pixels)]
    is_node = (number == 1) | (number > 2)
    number, count = number[is_node], np.count_nonzero(is_node)
    y, x = np.divmod(pixels[is_node].astype(np.int32), np.int32(padded.shape[1]))
    nodes = np.stack([y, x], axis=1)
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


def remove_spurs_and_islands(skeleton: Mask) -> Mask:
    """Erase short side branches and short isolated ridges from a skeleton (H, W)."""
    nodes = find_nodes(skeleton, max(MAX_ISLAND_PX, MAX_SPUR_PX))
    steps, target = nodes.steps[:, 0], nodes.target[:, 0]
    island = nodes.crossing_number[target] == 1
    short = steps <= np.where(island, MAX_ISLAND_PX, MAX_SPUR_PX)
    to_delete = np.flatnonzero((nodes.crossing_number == 1) & (target >= 0) & short)
    length = (steps - ~island)[to_delete, None]  # the node that a spur leads to stays
    y, x = nodes.paths[to_delete, 0][np.arange(nodes.paths.shape[2]) < length].T
    kept = np.array(skeleton, bool)
    kept[y, x] = False
    kept[nodes.y[to_delete], nodes.x[to_delete]] = False
    return kept


def directions(nodes: SkeletonNodes, length_px: int = DIRECTION_PX) -> Floats:
    """Compute the direction of each node from the first `length_px` pixels of its branches.

    Radians in [0, 2π), ISO/IEC 19794-2: for an ending along its ridge; for a bifurcation along the
    valley between its two closest branches.
    """
    last = np.clip(np.minimum(nodes.steps, length_px) - 1, 0, None)
    ends = np.take_along_axis(nodes.paths, last[..., None, None], axis=2)[:, :, 0]
    dx = (ends[..., 1] - nodes.x[:, None]).astype(np.float64)
    dy = (ends[..., 0] - nodes.y[:, None]).astype(np.float64)
    branch = np.where(nodes.steps > 0, dx - 1j * dy, 0)
    branch = branch / np.maximum(np.abs(branch), 1e-9)
    towards = branch[:, 0].copy()
    forks = np.flatnonzero(np.count_nonzero(nodes.steps, axis=1) >= 3)
    u = branch[forks, :3]
    closeness = (u * np.conj(np.roll(u, -1, axis=1))).real
    pair = closeness.argmax(axis=1)[:, None] + np.arange(3)
    near, next_, third = np.take_along_axis(u, pair % 3, axis=1).T
    towards[forks] = near + next_ - third
    return np.asarray(np.mod(np.angle(towards), 2 * np.pi), np.float32)


def filter_spurious(nodes: SkeletonNodes, angle: Floats, mask: Mask) -> Mask:
    """Return, for each node of the cleaned skeleton, whether it may be a genuine minutia.

    Rejected are nodes near the border of the mask (H, W) or of the image, both ends of a bridge or
    lake, both ends of a broken ridge, and minutiae closer together than those of fingers.
    """
    known = (nodes.crossing_number == 1) | (nodes.crossing_number == 3)
    forked = nodes.crossing_number >= 3
    short = (nodes.target >= 0) & (nodes.steps <= MAX_BRIDGE_PX)
    bridged = (short & forked[:, None] & forked[np.maximum(nodes.target, 0)]).any(axis=1)
    keep: Mask = known & ~bridged
    here = np.flatnonzero(keep)
    x, y, (height, width) = nodes.x[here], nodes.y[here], mask.shape
    edge = np.minimum.reduce([x, y, width - 1 - x, height - 1 - y])
    reach = math.ceil(MIN_MASK_DISTANCE_PX)
    others = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
    others[reach, reach] = 0
    near = cv2.distanceTransform(others, cv2.DIST_L2, 3) < MIN_MASK_DISTANCE_PX
    dy, dx = (axis - reach for axis in near.nonzero())
    rows = np.clip(y[:, None] + dy, 0, height - 1)
    columns = np.clip(x[:, None] + dx, 0, width - 1)
    here = here[mask[rows, columns].all(axis=1) & (edge >= MIN_BORDER_DISTANCE_PX)]
    keep[:] = False
    keep[here] = ~_crowded(nodes, angle, here)
    return keep


def _crowded(nodes: SkeletonNodes, angle: Floats, index: NDArray[np.intp]) -> Mask:
    """Return which of the minutiae `index` are too near another, or face it across a break."""
    x, y, reach = nodes.x[index], nodes.y[index], max(CROWDED_PX, BROKEN_PX)
    # each pair once whose x and y both differ by at most `reach`
    by_y = y.argsort(kind="stable")
    last = y[by_y].searchsorted(y[by_y] + reach, "right")
    partners = last - np.arange(1, len(y) + 1)
    first = np.repeat(np.arange(len(y)), partners)
    second = np.arange(len(first)) + np.repeat(last - partners.cumsum(), partners)
    i, j = by_y[first], by_y[second]
    near = np.abs(x[i] - x[j]) <= reach
    i, j = i[near], j[near]
    z = x - 1j * y
    away = z[i] - z[j]
    distance = np.abs(away)
    # an ending's direction runs along its own ridge: away from the other across a break
    along = np.exp(1j * angle[index].astype(np.float64))
    limit = distance * np.cos(np.radians(BROKEN_ANGLE_DEG))
    apart = ((away * np.conj(along[i])).real > limit) & ((-away * np.conj(along[j])).real > limit)
    ending = nodes.crossing_number[index] == 1
    broken = (distance < BROKEN_PX) & apart & ending[i] & ending[j]
    refused = (distance < CROWDED_PX) | broken
    crowded = np.zeros(len(index), bool)
    crowded[i[refused]] = crowded[j[refused]] = True
    return crowded


def minutia_quality(pixels: Floats, enhanced: Floats, x: Ints, y: Ints) -> Grey:
    """Measure the quality of the minutiae at `x` and `y`, 0 to 100.

    It is 100 times the correlation of the normalised and the enhanced image, both (H, W), in a
    Gaussian neighbourhood; 0 where the correlation is negative.
    """
    offsets = np.arange(-RADIUS_PX, RADIUS_PX + 1)
    gauss = np.exp(-(offsets**2) / (2 * SIGMA_PX**2))
    weight = np.outer(gauss, gauss).reshape(-1, 1)
    stride = pixels.shape[1] + 2 * RADIUS_PX
    centre = (y.astype(np.intp) + RADIUS_PX) * stride + x + RADIUS_PX
    at = (offsets[:, None] * stride + offsets).reshape(-1, 1) + centre
    a, b = (
        np.pad(one, RADIUS_PX).ravel().take(at).astype(np.float64) for one in (pixels, enhanced)
    )
    # from top to bottom, in which order `sum` does not add a single column
    cross, power, enhanced_power = (
        (weight * one).cumsum(axis=0)[-1] for one in (a * b, a * a, b * b)
    )
    correlation = cross / np.sqrt(np.maximum(power * enhanced_power, 1e-12))
    return np.asarray(np.clip(np.rint(100 * correlation), 0, 100), np.uint8)
