"""Fingers without images: orientation, period and phase of their ridges on a coarse lattice.

The distributions are those of `fpmatch.lab.synthesis.master`; many fingers are drawn at once, and
none depends on another.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.synthesis import orientation as flat
from fpmatch.lab.synthesis.master import AVERAGE_ROWS, PERIOD_LEVELS, MasterParameters
from fpmatch.lab.synthesis.noise import NO_IMPRESSION
from fpmatch.lab.synthesis.orientation import ARCHING, NATURAL_SHARES, SINGULAR_RANGES, PatternClass
from research.templates.numbers import (
    HALF,
    MASK,
    TURN,
    angle_of,
    between,
    keys_of,
    normal,
    smooth_grids,
    uniform,
)
from research.templates.ridges import (
    COARSE_SINE,
    LEVEL,
    MOST_MINUTIAE,
    STEP_PX,
    find_minutiae,
    grow_phase,
    link_nodes,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from research.templates.numbers import Doubles, Floats, Ints

PHASE_NOISE: Final = 0.33  # largest, in turns, while the phase grows
BIFURCATIONS: Final = 0.47  # share of the minutiae
_CLASSES: Final = tuple(PatternClass)
_LIMITS: Final = np.cumsum([NATURAL_SHARES[p] for p in _CLASSES])
_POINTS: Final = 4  # most singular points
_CORNERS: Final = 8  # of the correction around a singular point
_PER_DEGREE: Final = TURN / 360
_PURPOSES: Final = range(101, 108)


@dataclass(frozen=True, slots=True, eq=False)
class FingerBatch:
    """The lattices of B fingers, R rows and C columns of nodes, and their M minutiae.

    Angles are 65,536ths of a turn, lengths pixels at 500 dpi, x right and y down.
    """

    finger: NDArray[np.uint64]  # numbers, (B,)
    level: Ints = field(repr=False)  # ridge orientation, 0 to half a turn, (B, R, C)
    period: Floats = field(repr=False)  # (B, R, C)
    phase: Ints = field(repr=False)  # of the ridges, 0 on their crests, (B, R, C)
    inside: NDArray[np.bool_] = field(repr=False)  # nodes on the skin, (B, R, C)
    edges: Floats = field(repr=False)  # left and right end of the skin in each row, px, (B, R, 2)
    minutiae: list[Doubles] = field(repr=False)  # x, y and direction of each finger's, (M, 3)
    bifurcation: NDArray[np.bool_] = field(repr=False)  # of the minutiae, (B, 256)


def lattice_shape(p: MasterParameters) -> tuple[int, int]:
    """Return the rows and columns of the nodes of a master."""
    rows, columns = (int(np.ceil(side / STEP_PX)) + 1 for side in p.shape)
    return rows, columns


def draw_fingers(
    seed: int, finger: NDArray[np.uint64], p: MasterParameters | None = None
) -> FingerBatch:
    """Draw fingers by their numbers (B,), each on its own, whichever others there are."""
    p = p or MasterParameters()
    keys = [keys_of(seed, finger, NO_IMPRESSION, purpose) for purpose in _PURPOSES]
    shape = lattice_shape(p)
    edges = _silhouette(keys[3], shape, p)
    first = np.clip(np.floor(edges[..., :1] / STEP_PX), 0, shape[1])
    last = np.clip(np.ceil(edges[..., 1:] / STEP_PX) + 1, 0, shape[1])
    column = np.arange(shape[1])
    inside = (column >= first) & (column < last) & (edges[..., :1] < edges[..., 1:])
    level = np.where(inside, _orientation(keys[0], keys[1], shape, p), 0)
    period = _period(keys[2], shape, p)
    noise = uniform(keys[4], shape[0] * shape[1] + 1)
    swing = (noise[:, :-1].T - np.float32(0.5)) * np.float32(2 * PHASE_NOISE)
    lanes = [np.ascontiguousarray(part.transpose(1, 2, 0)) for part in (level, period, inside)]
    links = link_nodes(*lanes)
    wave = grow_phase(links, lanes[2], noise[:, -1], swing.reshape(*shape, -1))
    phase = np.where(inside, angle_of(*wave[::-1].transpose(0, 3, 1, 2)), 0)
    place = uniform(keys[5], 2 * shape[0] * shape[1]).reshape(*level.shape, 2)
    minutiae = find_minutiae(level, period, inside, links, phase, place)
    bifurcation = uniform(keys[6], MOST_MINUTIAE) < BIFURCATIONS
    return FingerBatch(finger, level, period, phase, inside, edges, minutiae, bifurcation)


def _orientation(
    keys: NDArray[np.uint64], noise: NDArray[np.uint64], shape: tuple[int, int], p: MasterParameters
) -> Ints:
    """Draw ridge orientations, as `fpmatch.lab.synthesis.orientation.ridge_orientation`."""
    corners = np.arange(_CORNERS) * (2 * np.pi / _CORNERS)
    drawn = uniform(keys, 18 + _POINTS * _CORNERS * 2).astype(np.float64)
    number = np.minimum(np.searchsorted(_LIMITS, drawn[:, 0] * _LIMITS[-1], "right"), 4)
    if p.pattern is not None:
        number = np.full(len(keys), _CLASSES.index(p.pattern))
    size = between(p.finger_size, drawn[:, 1]) * p.shape[0] / AVERAGE_ROWS
    mirrored = np.where(number == 2, False, (number == 3) | (drawn[:, 2] < 0.5))
    points = _BOXES[number, ..., 0] + drawn[:, 3:11].reshape(-1, _POINTS, 2) * (
        _BOXES[number, ..., 1] - _BOXES[number, ..., 0]
    )
    points = points * size[:, None, None]
    points[..., 0] *= np.where(mirrored, -1, 1)[:, None]
    share = _SHARES[number]
    bend = normal(drawn[:, 18:].reshape(-1, _POINTS, _CORNERS, 2))
    bend = bend * (flat.CORRECTION_DEG * _PER_DEGREE)
    is_core = share > 0
    cores = is_core.sum(axis=1)
    middle = (points * is_core[..., None]).sum(axis=1) / np.maximum(cores, 1)[:, None]
    towards = middle[:, None, :] - points
    to_cores = np.arctan2(towards[..., 1], towards[..., 0])[..., None]
    lean = between(flat.UPRIGHTNESS, drawn[:, 11])[:, None, None] * (to_cores - np.pi / 2)
    lean = lean * np.clip(np.cos(corners - to_cores), 0, 1) * (TURN / (2 * np.pi))
    bend -= np.where((share < 0)[..., None] & (cores > 0)[:, None, None], lean, 0)
    narrowing = between(flat.LOOP_NARROWING_DEG, drawn[:, 12]) * _PER_DEGREE
    for k in range(_POINTS):
        others = share * (np.arange(_POINTS) != k)
        opening = 2 * _turning(points[:, k, 0, None], points[:, k, 1, None], points, others, bend)
        at = np.floor(np.arange(_CORNERS) * (1.0 * TURN / _CORNERS) - opening).astype(np.int64)
        closer = narrowing[:, None] * COARSE_SINE[(at & MASK) >> 6].astype(np.float64)
        bend[:, k] -= np.where(is_core[:, k, None], closer, 0)
    column = slice(None), None, None
    y = ((0.5 * (shape[0] - 1) - np.arange(shape[0])) * STEP_PX)[:, None]
    x = (np.arange(shape[1]) - 0.5 * (shape[1] - 1)) * STEP_PX
    up = y / size[column]
    steepness = (between(_STEEPNESS[number].T, drawn[:, 13]) * _PER_DEGREE)[column]
    half_width = between(_HALF_WIDTH[number].T, drawn[:, 14])[column]
    wide = half_width * (1 + np.maximum(up / flat.WIDENING_PX, 0))
    above = steepness / (1 + np.exp(-(up + flat.JOINT_PX) / flat.JOINT_SOFTNESS_PX))
    across, along = (part.reshape(1, -1) for part in np.broadcast_arrays(x, y))
    turn = _turning(across, along, points, share, bend).reshape(-1, *shape)
    u = x / size[column] / wide
    turn -= above * u * np.exp(0.5 * (1 - u * u))
    swing = between(flat.VARIATION_DEG, drawn[:, 15]) * _PER_DEGREE
    variation = smooth_grids(noise, shape, flat.VARIATION_EXTENT_PX / STEP_PX)
    variation *= swing[column].astype(np.float32)
    turn += variation
    return (np.floor(turn / LEVEL + 0.5).astype(np.int64) * LEVEL) & (HALF - 1)


def _turning(x: Doubles, y: Doubles, points: Doubles, share: Doubles, bend: Doubles) -> Doubles:
    """Return by how much singular points turn the ridges at places x, y (B or 1, N), y up."""
    total = np.zeros((len(points), x.shape[1]))
    for k in range(_POINTS):
        argument = angle_of(y - points[:, k, 1, None], x - points[:, k, 0, None])
        corner, t = argument >> 13, (argument & 8191) * (1.0 / 8192)
        before, after = (
            np.take_along_axis(bend[:, k], part, axis=1) for part in (corner, (corner + 1) & 7)
        )
        bent = before * (1 - t) + after * t
        total += share[:, k, None] * (np.where(argument >= HALF, argument - TURN, argument) + bent)
    return total


def _period(keys: NDArray[np.uint64], shape: tuple[int, int], p: MasterParameters) -> Floats:
    """Draw ridge periods, as `fpmatch.lab.synthesis.master.ridge_period`."""
    q = p.period
    drawn = normal(uniform(keys, 2))
    mean = np.clip(q.mean_px + q.between_fingers_px * drawn, *q.mean_range_px)
    noise = smooth_grids(keys, shape, q.variation_extent_px / STEP_PX, skip=2)
    varied = q.variation_share * np.clip(noise, -q.max_deviations, q.max_deviations)
    towards_joint = np.linspace(q.tip_share, q.joint_share, shape[0])[:, None]
    period = mean[:, None, None] * (1 + towards_joint + varied)
    return np.asarray(np.rint(period * PERIOD_LEVELS) / PERIOD_LEVELS, np.float32)


def _silhouette(keys: NDArray[np.uint64], shape: tuple[int, int], p: MasterParameters) -> Floats:
    """Draw outlines, as `fingertip_silhouette`: left and right end of each row of nodes, px."""
    q, (height, width) = p.silhouette, p.shape
    drawn = uniform(keys, 6).astype(np.float64)
    half_width = between(q.half_width, drawn[:, 0])[:, None] * width
    tip, foot = (
        between(heights, drawn[:, k])[:, None] * height
        for k, heights in ((1, q.tip_height), (2, q.foot_height))
    )
    tip_exponent = between(q.tip_exponent, drawn[:, 3])[:, None]
    foot_exponent = between(q.foot_exponent, drawn[:, 4])[:, None]
    middle = (0.5 + between(q.off_middle, drawn[:, 5]))[:, None] * width
    up = height / 2 - np.arange(shape[0]) * STEP_PX
    exponent = np.where(up >= 0, tip_exponent, foot_exponent)
    along = np.where(up >= 0, up / tip, -up / foot)
    reach = half_width * np.clip(1 - along**exponent, 0, None) ** (1 / exponent)
    return np.asarray(np.stack([middle - reach, middle + reach], axis=-1), np.float32)


def _boxes() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ranges (class, point, axis, 2) of singular points, y up, and their shares."""
    boxes, shares = np.zeros((len(_CLASSES), _POINTS, 2, 2)), np.zeros((len(_CLASSES), _POINTS))
    for number, pattern in enumerate(_CLASSES):
        ranges = SINGULAR_RANGES[pattern]
        for k, box in enumerate((*ranges.cores, *ranges.deltas)):
            boxes[number, k] = box
            shares[number, k] = 0.5 if k < len(ranges.cores) else -0.5
    return boxes, shares


_BOXES, _SHARES = _boxes()
_STEEPNESS: Final = np.array([ARCHING[pattern].steepness_deg for pattern in _CLASSES])
_HALF_WIDTH: Final = np.array([ARCHING[pattern].half_width_px for pattern in _CLASSES])
