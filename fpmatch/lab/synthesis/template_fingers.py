"""Fingers without images: orientation, period and phase of their ridges on a coarse lattice.

The distributions are those of `fpmatch.lab.synthesis.master`; many fingers are drawn at once, and
none depends on another.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.synthesis import _ridge_phase_kernel as kernel
from fpmatch.lab.synthesis.classes import NATURAL_SHARES, SINGULAR_RANGES, PatternClass
from fpmatch.lab.synthesis.master import AVERAGE_ROWS, PERIOD_LEVELS, MasterParameters
from fpmatch.lab.synthesis.noise import NO_IMPRESSION, keys_of, spline_weights, uniform
from fpmatch.lab.synthesis.orientation import ARCHING

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float32]
    Ints = NDArray[np.int32]

STEP_PX: Final = 10.0  # from node to node of the lattice
TURN: Final = 65536  # angles are this part of a turn
RELAXATIONS: Final = 1
PHASE_NOISE: Final = 0.33  # largest, in turns, while the phase grows
SPACING: Final = 0.9  # ridge periods between two minutiae
BIFURCATIONS: Final = 0.47  # share of the minutiae
MOST_MINUTIAE: Final = 256  # of a finger
_CLASSES: Final = tuple(PatternClass)
_LIMITS: Final = np.cumsum([NATURAL_SHARES[p] for p in _CLASSES])
_POINTS: Final = 4  # most singular points
_LEVEL: Final = 16  # of orientations
_ANGLES: Final = np.arange(TURN // 2 // _LEVEL) * (2 * np.pi * _LEVEL / TURN)
_COSINE, _SINE = np.cos(_ANGLES).astype(np.float32), np.sin(_ANGLES).astype(np.float32)
_FAINT: Final = 1e-6  # against unit vectors
_PER_DEGREE: Final = TURN / 360
_SQRT_12: Final = np.float32(np.sqrt(12))  # times an even number around 0: a deviation of 1
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
    inside: Ints = field(repr=False)  # columns of nodes, first and one past the last, (B, R, 2)
    edges: Floats = field(repr=False)  # left and right end of the skin in each row, px, (B, R, 2)
    minutiae: NDArray[np.float64] = field(repr=False)  # x, y and direction, (B, 256, 3)
    count: Ints = field(repr=False)  # minutiae of each finger, (B,)
    bifurcation: NDArray[np.uint8] = field(repr=False)  # 1 for each that is one, (B, 256)


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
    inside = np.empty(edges.shape, np.int32)
    inside[..., 0] = np.clip(np.floor(edges[..., 0] / STEP_PX), 0, shape[1])
    inside[..., 1] = np.clip(np.ceil(edges[..., 1] / STEP_PX) + 1, 0, shape[1])
    inside[edges[..., 0] >= edges[..., 1]] = 0
    level = _orientation(keys[0], keys[1], shape, inside, p)
    period = _period(keys[2], shape, p)
    link, wave = _grow(keys[4], level, period, inside)
    place = uniform(keys[5], 2 * shape[0] * shape[1]).reshape(*level.shape, 2)
    minutiae, count = np.empty((len(finger), MOST_MINUTIAE, 3)), np.empty(len(finger), np.int32)
    phase, turns = np.zeros(level.shape, np.int32), np.zeros((2, *shape))
    kernel.find_vortices(
        level, period, inside, link, wave, STEP_PX, SPACING, place, phase, turns, minutiae, count
    )  # fmt: skip
    bifurcation = (uniform(keys[6], MOST_MINUTIAE) < BIFURCATIONS).astype(np.uint8)
    return FingerBatch(finger, level, period, phase, inside, edges, minutiae, count, bifurcation)


def _grow(
    keys: NDArray[np.uint64], level: Ints, period: Floats, inside: Ints
) -> tuple[Floats, Floats]:
    """Return links and phases of the lattices, as ``_ridge_phase_kernel.grow_phase`` fills them."""
    size, rows, columns = level.shape
    padded = rows + 2, columns + 2, size
    column = np.arange(columns, dtype=np.int32)[:, None]
    first, last = (inside[..., k].T[:, None, :] for k in (0, 1))
    is_inside = np.zeros(padded, np.float32)
    middle = (slice(1, -1),) * 2
    is_inside[middle] = (column >= first) & (column < last)
    normal = np.zeros((2, *padded), np.float32)
    across = (is_inside[middle] / period.transpose(1, 2, 0)).astype(np.float32)
    level = level.transpose(1, 2, 0) // _LEVEL
    normal[(0, *middle)] = -_SINE[level] * across
    normal[(1, *middle)] = -_COSINE[level] * across  # y down
    noise = uniform(keys, rows * columns + 1)
    start = _FAINT * np.stack([f(2 * np.pi * noise[:, -1]) for f in (np.cos, np.sin)])
    swing = (noise[:, :-1].T - np.float32(0.5)) * np.float32(2 * PHASE_NOISE)
    swing = np.ascontiguousarray(swing).reshape(rows, columns, size)
    link, wave = np.zeros((4, 4, *padded), np.float32), np.zeros((2, *padded), np.float32)
    kernel.grow_phase(
        normal, is_inside, swing, start.astype(np.float32), STEP_PX, RELAXATIONS,
        np.empty((2, size), np.float32), link, wave,
    )  # fmt: skip
    return link, wave


def smooth_grids(
    keys: NDArray[np.uint64], shape: tuple[int, int], extent: float, skip: int = 0
) -> Floats:
    """Draw smooth random fields (B, rows, columns), as `smooth_noise`; extent in their steps.

    The numbers of the streams from the one after `skip` on are used.
    """
    down, across = (spline_weights(side, extent) for side in shape)
    rows, columns = down.shape[1], across.shape[1]
    values = uniform(keys, skip + rows * columns)[:, skip:] - np.float32(0.5)
    values = values.reshape(-1, rows, columns) * _SQRT_12
    return np.asarray(down @ values @ across.T, np.float32)


def _orientation(
    keys: NDArray[np.uint64],
    noise: NDArray[np.uint64],
    shape: tuple[int, int],
    inside: Ints,
    p: MasterParameters,
) -> Ints:
    zero_pole = p.orientation.zero_pole
    corners = np.arange(8) * (2 * np.pi / 8)
    drawn = uniform(keys, 18 + _POINTS * 8 * 2).astype(np.float64)
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
    normal = _normal(drawn[:, 18:].reshape(-1, _POINTS, 8, 2))
    bend = normal * (zero_pole.correction_deg * _PER_DEGREE)
    is_core = share > 0
    cores = is_core.sum(axis=1)
    middle = (points * is_core[..., None]).sum(axis=1) / np.maximum(cores, 1)[:, None]
    towards = middle[:, None, :] - points
    to_cores = np.arctan2(towards[..., 1], towards[..., 0])[..., None]
    lean = between(zero_pole.uprightness, drawn[:, 11])[:, None, None] * (to_cores - np.pi / 2)
    lean = lean * np.clip(np.cos(corners - to_cores), 0, 1) * (TURN / (2 * np.pi))
    bend -= np.where((share < 0)[..., None] & (cores > 0)[:, None, None], lean, 0)
    narrowing = between(zero_pole.loop_narrowing_deg, drawn[:, 12]) * _PER_DEGREE
    arching = np.empty((len(keys), 6))
    arching[:, 0] = between(_STEEPNESS[number].T, drawn[:, 13]) * _PER_DEGREE
    arching[:, 1] = between(_HALF_WIDTH[number].T, drawn[:, 14])
    q = p.orientation
    arching[:, 2:5] = q.widening_px, q.joint_px, q.joint_softness_px
    arching[:, 5] = size
    swing = between(q.variation_deg, drawn[:, 15]) * _PER_DEGREE
    variation = smooth_grids(noise, shape, q.variation_extent_px / STEP_PX)
    variation *= swing[:, None, None].astype(np.float32)
    level = np.zeros((len(keys), *shape), np.int32)
    kernel.draw_orientation(
        points, share, (share != 0).sum(axis=1).astype(np.int32), bend, narrowing, arching,
        variation, inside, STEP_PX, level,
    )  # fmt: skip
    return level


def _period(keys: NDArray[np.uint64], shape: tuple[int, int], p: MasterParameters) -> Floats:
    """Draw ridge periods, as `fpmatch.lab.synthesis.master.ridge_period`."""
    q = p.period
    normal = _normal(uniform(keys, 2))
    mean = np.clip(q.mean_px + q.between_fingers_px * normal, *q.mean_range_px)
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


def between(limits: tuple[float, float], share: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the values at shares of the way between two limits."""
    low, high = limits
    return np.asarray(low + (high - low) * share, np.float64)


def _normal(even: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return standard normal numbers from pairs of even ones, (..., 2) (Box and Muller)."""
    radius = np.sqrt(-2 * np.log1p(-even[..., 0].astype(np.float64)))
    return np.asarray(radius * np.cos(2 * np.pi * even[..., 1]), np.float64)


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
