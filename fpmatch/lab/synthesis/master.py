"""A master print: all properties of one finger, before it touches a sensor.

Its ridges are grown from random seeds by oriented filtering.

References
----------
Cappelli, Erol, Maio, Maltoni, "Synthetic fingerprint-image generation", ICPR 2000 (SFinGe).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.synthesis.noise import NO_IMPRESSION, random_streams, smooth_noise
from fpmatch.lab.synthesis.orientation import (
    PatternClass,
    Range,
    draw_pattern,
    draw_singular_points,
    ridge_orientation,
)
from fpmatch.templates.minutiae import Minutiae, MinutiaKind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Field = NDArray[np.float32]
    Mask = NDArray[np.bool_]
    Taps = list[tuple[NDArray[np.intp], np.float32]]  # flat pixel indices, and their weight

AVERAGE_ROWS: Final = 560  # of a print of average size, to which lengths in the classes refer
# The growth of ridges; lengths are ridge periods.
ACROSS_SIGMA: Final = 0.45  # width of the oriented filter
ALONG_SIGMA, ALONG_REACH = 0.6, 1.6
TAPS: Final = 8  # on either side, across and along
SEEDS_PER_SQUARE_PERIOD: Final = 0.7
STEPS: Final = 18  # enough to fill the print; more remove minutiae
GAIN: Final = 3.0  # before clipping to -1..1; more grows faster
BLUR: Final = 0.08  # weight of a neighbour; hides the rounding of taps to pixels
DOT: Final = 0.6  # largest area of a spot or hole that is smoothed away, periods squared
SETTLING_STEPS: Final = 3  # steps after that
_STEPS: Final = 2.0**20  # of cosines and weights, which are rounded so that machines agree
# Flaws that are no minutiae; lengths in local ridge periods.
FLAW_BRANCH: Final = 1.1  # a shorter ridge is a spur or an island
FLAW_SPACING: Final = 0.9  # two nearer minutiae are one flaw
FLAW_ALONG: Final = 1.4  # and two on one ridge: a break, an island, a hole, a spur
FLAW_ACROSS: Final = 0.5  # distance across ridges up to which they are on one ridge
_BRANCHES: Final = {MinutiaKind.ENDING: 1, MinutiaKind.BIFURCATION: 3}  # = crossing number
PERIOD_LEVELS: Final = 64
"""Periods are whole multiples of a pixel over this, so that rounding differs on no machine."""


@dataclass(frozen=True, slots=True)
class PeriodParameters:
    """Set the ridge period; lengths are pixels at 500 dpi."""

    mean_px: float = 8.5
    between_fingers_px: float = 0.55  # standard deviation of a finger's mean
    mean_range_px: Range = (7.4, 10.0)
    tip_share: float = -0.05  # width at the tip relative to the mean
    joint_share: float = 0.10  # and at the joint
    variation_share: float = 0.07  # standard deviation within a finger
    variation_extent_px: float = 32.0
    max_deviations: float = 2.0


@dataclass(frozen=True, slots=True)
class SilhouetteParameters:
    """Set the outline: a round tip above straight sides above a flatter foot; shares of the print.

    Heights are shares of the rows, widths of the columns.
    """

    half_width: Range = (0.40, 0.47)  # at the widest
    tip_height: Range = (0.40, 0.46)  # from the widest row to the tip
    foot_height: Range = (0.40, 0.47)  # and to the joint
    tip_exponent: Range = (2.0, 2.3)  # of the superellipse: 2 is round, more is squarer
    foot_exponent: Range = (2.8, 4.5)
    off_middle: Range = (-0.01, 0.01)


@dataclass(frozen=True, slots=True)
class MasterParameters:
    """Set how masters are made: a smaller print has a smaller pattern of equal ridge width."""

    shape: tuple[int, int] = (AVERAGE_ROWS, 440)  # rows and columns at 500 dpi
    finger_size: Range = (0.92, 1.06)  # relative to an average finger
    pattern: PatternClass | None = None  # of every finger; None draws in the natural proportions
    period: PeriodParameters = field(default_factory=PeriodParameters)
    silhouette: SilhouetteParameters = field(default_factory=SilhouetteParameters)


@dataclass(frozen=True, slots=True, eq=False)
class Master:
    """One finger: its ridges on all the skin that a sensor may touch, at 500 dpi.

    The same seed and number give the same arrays, of shape (H, W).
    """

    seed: int
    finger: int
    pattern: PatternClass
    orientation: NDArray[np.float32] = field(repr=False)  # in [0, π), counter-clockwise from +x
    period: NDArray[np.float32] = field(repr=False)  # pixels from ridge to ridge
    relief: NDArray[np.float32] = field(repr=False)  # -1 in the valleys to 1 on the ridges
    silhouette: NDArray[np.bool_] = field(repr=False)  # True on the print
    minutiae: Minutiae = field(repr=False)  # all inside the silhouette
    cores: NDArray[np.float64] = field(repr=False)  # x and y in pixels, shape (K, 2)
    deltas: NDArray[np.float64] = field(repr=False)  # also beyond the silhouette


def make_master(seed: int, finger: int, parameters: MasterParameters | None = None) -> Master:
    """Make one finger, by its number from 0, of the family that `seed` names.

    No finger depends on another.
    """
    p = parameters or MasterParameters()
    classing, placing, turning, spacing, outlining, growing = random_streams(
        seed, finger, NO_IMPRESSION, range(1, 7)
    )
    rows, columns = p.shape
    pattern = p.pattern or draw_pattern(classing)
    size = placing.uniform(*p.finger_size) * rows / AVERAGE_ROWS
    points = draw_singular_points(pattern, (columns / 2, rows / 2), placing, size)
    orientation = ridge_orientation(pattern, points, p.shape, turning, size)
    period = ridge_period(p.shape, spacing, p.period)
    silhouette = fingertip_silhouette(p.shape, outlining, p.silhouette)
    relief = grow_ridges(orientation, period, growing)
    minutiae = list_minutiae(relief, orientation, period, silhouette)
    layers = orientation, period, relief, silhouette
    return Master(seed, finger, pattern, *layers, minutiae, points.cores, points.deltas)


def ridge_period(
    shape: tuple[int, int], rng: np.random.Generator, p: PeriodParameters
) -> NDArray[np.float32]:
    """Draw the ridge period map (rows, columns) of a finger in pixels, wider towards the joint."""
    drawn = p.mean_px + p.between_fingers_px * rng.standard_normal()
    mean = float(np.clip(drawn, *p.mean_range_px))
    noise = smooth_noise(shape, p.variation_extent_px, rng)
    towards_joint = np.linspace(p.tip_share, p.joint_share, shape[0])[:, None]
    varied = p.variation_share * np.clip(noise, -p.max_deviations, p.max_deviations)
    period = mean * (1 + towards_joint + varied)
    return np.asarray(np.rint(period * PERIOD_LEVELS) / PERIOD_LEVELS, np.float32)


def fingertip_silhouette(
    shape: tuple[int, int], rng: np.random.Generator, p: SilhouetteParameters
) -> NDArray[np.bool_]:
    """Draw the outline of one fingertip; return its inside, (rows, columns)."""
    rows, columns = shape
    half_width = rng.uniform(*p.half_width) * columns
    tip, foot = rng.uniform(*p.tip_height) * rows, rng.uniform(*p.foot_height) * rows
    tip_exponent, foot_exponent = rng.uniform(*p.tip_exponent), rng.uniform(*p.foot_exponent)
    middle = (0.5 + rng.uniform(*p.off_middle)) * columns
    up = rows / 2 - np.arange(rows)[:, None]
    across = np.abs(np.arange(columns)[None] - middle) / half_width
    on_tip = across**tip_exponent + (np.clip(up, 0, None) / tip) ** tip_exponent <= 1
    on_foot = across**foot_exponent + (np.clip(-up, 0, None) / foot) ** foot_exponent <= 1
    return np.asarray(np.where(up >= 0, on_tip, on_foot), np.bool_)


def grow_ridges(orientation: Field, period: Field, rng: np.random.Generator) -> Field:
    """Grow ridges along an orientation field until they fill the print.

    `orientation` is in radians, counter-clockwise on screen, `period` in pixels, both (H, W). The
    Gabor-like filter is separable in the local frame: a cosine under a Gaussian across the ridges,
    then a Gaussian along them, each a weighted sum of nearest pixels. Returns the relief (H, W),
    from -1 in the valleys to 1 on the ridges.
    """
    across, along = _filters(orientation, period)
    relief = np.zeros(orientation.size, np.float32)
    mean_period = float(np.mean(period, dtype=np.float64))
    seeds = int(SEEDS_PER_SQUARE_PERIOD * relief.size / mean_period**2)
    relief[rng.integers(0, relief.size, max(seeds, 1))] = 1.0
    gain, blur = np.float32(GAIN), np.float32(BLUR)
    own = 1 - 2 * blur
    for step in range(STEPS):
        if STEPS - step == SETTLING_STEPS:
            smooth = without_dots_and_holes(relief.reshape(orientation.shape), DOT * period**2)
            relief = smooth.ravel()
        relief = np.clip(gain * relief, -1, 1)
        relief = _weighted_sum(_weighted_sum(relief, across), along)
        padded = np.pad(relief.reshape(orientation.shape), 1, mode="edge")
        padded = own * padded[1:-1] + blur * (padded[:-2] + padded[2:])
        relief = (own * padded[:, 1:-1] + blur * (padded[:, :-2] + padded[:, 2:])).ravel()
    return np.asarray(np.clip(relief.reshape(orientation.shape), -1, 1))


def without_dots_and_holes(relief: Field, largest_px: Field) -> Field:
    """Invert dots of ridge and holes in ridges in a relief, (H, W), positive on ridges.

    `largest_px` (H, W) is the area in pixels below which a spot is a dot or a hole.
    """
    from scipy import ndimage  # noqa: PLC0415

    ridges, _ = ndimage.label(relief > 0, np.ones((3, 3)))  # joined at corners
    dots = (ridges > 0) & (np.bincount(ridges.ravel())[ridges] < largest_px)
    cleaned = np.where(dots, -relief, relief)
    valleys, _ = ndimage.label(cleaned <= 0)  # not joined at corners
    holes = (valleys > 0) & (np.bincount(valleys.ravel())[valleys] < largest_px)
    return np.asarray(np.where(holes, -cleaned, cleaned), np.float32)


def _filters(orientation: Field, period: Field) -> tuple[Taps, Taps]:
    """Return the taps across the ridges and along them."""
    dx, dy = period * _rounded(np.cos(orientation)), period * _rounded(np.sin(orientation))
    x = np.linspace(-1, 1, 2 * TAPS + 1)
    wave, envelope = np.cos(2 * np.pi * x), np.exp(-0.5 * (x / ACROSS_SIGMA) ** 2)
    blind = envelope * (wave - envelope @ wave / envelope.sum())  # to a uniform level
    across = _taps(-dy, dx, x, blind / (blind @ wave))
    x = np.linspace(-ALONG_REACH, ALONG_REACH, 2 * TAPS + 1)
    envelope = np.exp(-0.5 * (x / ALONG_SIGMA) ** 2)
    return across, _taps(dx, dy, x, envelope / envelope.sum())


def _taps(
    dx: Field, dy: Field, distances: NDArray[np.float64], weights: NDArray[np.float64]
) -> Taps:
    """Return the nearest pixels at the given distances along (dx, dy), y up, from every pixel."""
    rows, columns = dx.shape
    y, x = np.mgrid[:rows, :columns].astype(np.float32)
    taps = []
    for distance, weight in zip(_rounded(distances), _rounded(weights), strict=True):
        column = np.clip(np.rint(x + distance * dx), 0, columns - 1)
        row = np.clip(np.rint(y - distance * dy), 0, rows - 1)
        taps.append(((row * columns + column).astype(np.intp).ravel(), weight))
    return taps


def _rounded(values: NDArray[np.floating]) -> Field:
    return np.asarray(np.rint(values * _STEPS) / _STEPS, np.float32)


def _weighted_sum(values: Field, taps: Taps) -> Field:
    total = np.zeros_like(values)
    for pixel, weight in taps:
        total += weight * values[pixel]
    return total


def list_minutiae(relief: Field, orientation: Field, period: Field, silhouette: Mask) -> Minutiae:
    """List the minutiae of a clean relief, by crossing numbers on the skeleton of its ridges.

    All arrays are (H, W): relief, positive on ridges; ridge orientation in radians,
    counter-clockwise; ridge period in pixels; area in which minutiae are listed. Spurs, islands,
    breaks, holes and minutiae too near each other are left out, as an examiner would. Minutiae are
    ordered from top to bottom.
    """
    from skimage.morphology import skeletonize  # noqa: PLC0415

    skeleton = np.asarray(skeletonize(relief > 0), np.bool_)  # type: ignore[no-untyped-call]
    crossing = crossing_numbers(skeleton)
    margin = int(np.ceil(period.max() * max(FLAW_BRANCH, 1.0)))
    off_border = np.zeros_like(silhouette)
    off_border[margin:-margin, margin:-margin] = True
    listed: list[tuple[float, float, float, float, float]] = []
    for kind, branches in _BRANCHES.items():
        for row, column in np.argwhere(skeleton & off_border & (crossing == branches)):
            ways = _ways_out(skeleton, row, column, FLAW_BRANCH * float(period[row, column]))
            axis = float(orientation[row, column])
            ahead = sum(np.sign((way * np.exp(-1j * axis)).real) for way in ways)
            direction = axis if ahead > 0 else axis + np.pi  # to most of the ways
            listed.append((column, row, direction, kind, len(ways) == branches))
    x, y, angle, codes, whole = np.array(listed, np.float32).reshape(-1, 5).T
    minutiae = Minutiae(x, y, angle, codes.astype(np.uint8))
    place = y.astype(np.intp), x.astype(np.intp)
    minutiae = minutiae.take(silhouette[place] & (whole > 0) & ~_too_near(minutiae, period[place]))
    return minutiae.take(np.lexsort((minutiae.x, minutiae.y)))


def crossing_numbers(skeleton: Mask) -> NDArray[np.int64]:
    """Return half the number of changes from pixel to pixel around each pixel, shape (H, W)."""
    padded = np.pad(skeleton, 1).astype(np.int64)
    rows, columns = skeleton.shape
    ring = ((0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0), (0, 0))
    around = np.stack([padded[top : top + rows, left : left + columns] for top, left in ring])
    return np.asarray(np.abs(around - np.roll(around, 1, axis=0)).sum(axis=0) // 2)


def _ways_out(skeleton: Mask, row: int, column: int, reach: float) -> list[complex]:
    """Return where the skeleton from a pixel leaves the disk of radius `reach` around it.

    The points are x + iy from the pixel, y up; branches that end within are not among them.
    """
    from scipy import ndimage  # noqa: PLC0415

    side = int(np.ceil(reach))
    window = skeleton[row - side : row + side + 1, column - side : column + side + 1]
    y, x = np.mgrid[side : -side - 1 : -1, -side : side + 1]
    distance = np.hypot(x, y)
    eight = np.ones((3, 3))
    whole, _ = ndimage.label(window & (distance <= reach), eight)
    own = whole == whole[side, side]
    rim, count = ndimage.label(own & (distance > reach - np.sqrt(2)), eight)
    return [complex(x[rim == i].mean(), y[rim == i].mean()) for i in range(1, count + 1)]


def _too_near(minutiae: Minutiae, period: Field) -> Mask:
    """Return which minutiae have another so near that the two are one flaw."""
    place = minutiae.x.astype(np.float64) - 1j * minutiae.y
    along = np.exp(-1j * minutiae.angle.astype(np.float64))[:, None]
    between = (place[None] - place[:, None]) * along / period[:, None]
    np.fill_diagonal(between, np.inf)
    on_one_ridge = (np.abs(between.real) < FLAW_ALONG) & (np.abs(between.imag) < FLAW_ACROSS)
    near = (np.abs(between) < FLAW_SPACING) | on_one_ridge
    return np.asarray((near | near.T).any(axis=1))
