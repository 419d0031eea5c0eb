#!/usr/bin/env python3
"""Make FVC-style synthetic impressions with exactly known transforms and minutiae.

A master print is an orientation field (zero-pole model) along which ridges are grown from random
seeds by iterated oriented filtering, so that its minutiae emerge by themselves. An impression is
the master turned, shifted, stretched, pressed unevenly on a white sensor, scratched and worn.
Every number is drawn from one seed: the same seed gives the same pictures and the same truth.

References
----------
Sherlock, Monro, "A model for interpreting fingerprint topology", Pattern Recognition 26 (1993).
Cappelli, Erol, Maio, Maltoni, "Synthetic fingerprint-image generation", ICPR 2000 (SFinGe).
Cappelli, Maio, Maltoni, "Modelling plastic distortion in fingerprint images", ICAPR 2001.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from skimage.morphology import skeletonize

from fpmatch.minutiae import Minutiae, MinutiaKind
from fpmatch.pointset.similarity import Similarity

Array = NDArray[np.float64]
Field = NDArray[np.float32]  # a value a pixel
Range = tuple[float, float]

DPI: Final = 500  # all lengths below are pixels at this resolution
MASTER_SHAPE: Final = (520, 440)  # rows, columns; covers all that a sensor may touch
SENSOR_SHAPE: Final = (420, 340)
PAD_HALF_AXES: Final = (136.0, 180.0)  # of the ellipse of skin that touches
FIRST_FINGER: Final = 101
DEFAULT_SEED: Final = 2002
DEFAULT_FOLDER: Final = Path(__file__).resolve().parent.parent / "sample_data"


# --- the finger ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Pattern:
    """Hold the singular points of a class of prints and how its ridges arch over the fingertip."""

    name: str
    cores: tuple[complex, ...]  # x + iy from the centre of the master, y up
    deltas: tuple[complex, ...]
    arch_deg: float  # steepest slope that the arching adds
    arch_half_width: float  # where, either side of the middle


PATTERNS: Final = (  # fingers take them in turn
    Pattern("left loop", (0 + 30j,), (88 - 95j,), 40.0, 115.0),
    Pattern("whorl", (-6 + 58j, 8 - 4j), (-98 - 105j, 100 - 112j), 34.0, 115.0),
    Pattern("right loop", (0 + 30j,), (-84 - 100j,), 40.0, 115.0),
    Pattern("arch", (), (), 50.0, 72.0),
    Pattern("left loop", (-6 + 15j,), (80 - 85j,), 36.0, 105.0),
    Pattern("whorl", (-14 + 50j, 16 - 22j), (-100 - 110j, 95 - 115j), 34.0, 115.0),
    Pattern("right loop", (6 + 20j,), (-95 - 80j,), 44.0, 120.0),
    Pattern("tented arch", (0 + 18j,), (3 - 62j,), 42.0, 95.0),
)


@dataclass(frozen=True, slots=True)
class Skin:
    """Set how ridges run and grow."""

    singular_jitter: float = 6.0  # standard deviation of singular points, pixels
    period: Range = (8.2, 9.3)  # range of a finger's mean ridge period, pixels
    period_variation: float = 0.07  # standard deviation within a finger, share of the mean
    orientation_variation_deg: float = 5.5  # standard deviation around the model
    variation_extent: float = 30.0  # pixels over which period and orientation vary
    across_sigma: float = 0.45  # width of the oriented filter, ridge periods
    along_sigma: float = 0.6
    taps_per_period: int = 8
    seeds: int = 2000  # spots from which ridges grow
    steps: int = 14  # enough to fill the print; each further one anneals minutiae away
    gain: float = 3.0  # before clipping to -1..1; more grows faster
    texture: float = 0.28  # relief of pores and rough edges, which all impressions share
    texture_extent: float = 1.3
    max_creases: int = 3


@dataclass(frozen=True, slots=True)
class Finger:
    """Hold one master print, in pixels of `MASTER_SHAPE`, and its true minutiae."""

    pattern: str
    relief: Field  # about -1 in the valleys to 1 on the ridges
    creases: Field  # 0 to 1: where a crease keeps the skin off every sensor
    minutiae: Minutiae


def make_finger(number: int, seed: int, skin: Skin | None = None) -> Finger:
    """Grow finger `number` (from 0) of the family that `seed` names."""
    skin = skin or Skin()
    rng = np.random.default_rng([seed, number])
    pattern = PATTERNS[number % len(PATTERNS)]
    orientation = ridge_orientation(pattern, skin, rng)
    relief = grow_ridges(orientation, ridge_period(skin, rng), skin, rng)
    texture = skin.texture * smooth_noise(MASTER_SHAPE, skin.texture_extent, rng)
    creases = scratches(MASTER_SHAPE, rng.integers(0, skin.max_creases + 1), rng)
    return Finger(pattern.name, relief + texture, creases, true_minutiae(relief, orientation))


def ridge_orientation(pattern: Pattern, skin: Skin, rng: np.random.Generator) -> Field:
    """Return the ridge orientation in radians, counter-clockwise on screen, modulo π.

    The zero-pole model turns by half the argument around each core and back around each delta. A
    smooth arching term, which leaves the singular points where they are, steepens the flanks.
    """
    rows, columns = MASTER_SHAPE
    y, x = np.mgrid[rows / 2 : -rows / 2 : -1, -columns / 2 : columns / 2]
    turning = np.zeros(MASTER_SHAPE)
    for points, index in ((pattern.cores, 0.5), (pattern.deltas, -0.5)):
        for point in points:
            jitter = complex(*rng.normal(scale=skin.singular_jitter, size=2))
            turning += index * np.angle(x + 1j * y - point - jitter)
    u = x / (pattern.arch_half_width * (1 + np.clip(y / 400.0, 0, None)))  # widens to the tip
    above_joint = 1 / (1 + np.exp(-(y + 90.0) / 30.0))
    arching = -math.radians(pattern.arch_deg) * u * np.exp((1 - u**2) / 2) * above_joint
    noise = smooth_noise(MASTER_SHAPE, skin.variation_extent, rng)
    orientation = turning + arching + math.radians(skin.orientation_variation_deg) * noise
    return np.asarray(orientation, np.float32)


def ridge_period(skin: Skin, rng: np.random.Generator) -> Field:
    """Return the ridge period in pixels: smoothly varying, wider towards the joint."""
    mean = rng.uniform(*skin.period)
    noise = smooth_noise(MASTER_SHAPE, skin.variation_extent, rng)
    towards_joint = np.linspace(-0.05, 0.10, MASTER_SHAPE[0])[:, None]
    period = mean * (1 + towards_joint + skin.period_variation * np.clip(noise, -2, 2))
    return period.astype(np.float32)


def grow_ridges(orientation: Field, period: Field, skin: Skin, rng: np.random.Generator) -> Field:
    """Grow ridges from random seeds until they fill the print; return the relief, -1 to 1.

    The Gabor-like filter is separable in the local frame: a cosine under a Gaussian across the
    ridges, then a Gaussian along them, each a weighted sum of nearest pixels.
    """
    taps = np.arange(-skin.taps_per_period, skin.taps_per_period + 1) / skin.taps_per_period
    wave, envelope = np.cos(2 * np.pi * taps), np.exp(-0.5 * (taps / skin.across_sigma) ** 2)
    across = envelope * (wave - envelope @ wave / envelope.sum())  # blind to a uniform level
    along = np.exp(-0.5 * (2 * taps / skin.along_sigma) ** 2)
    filters = [
        (tap_pixels(orientation + np.float32(np.pi / 2), period, taps), across / (across @ wave)),
        (tap_pixels(orientation, period, 2 * taps), along / along.sum()),
    ]
    ridges = np.zeros(orientation.size, np.float32)
    ridges[rng.integers(0, ridges.size, skin.seeds)] = 1.0
    for _ in range(skin.steps):
        ridges = np.clip(skin.gain * ridges, -1, 1)
        for pixels, weights in filters:
            ridges = _weighted_sum(ridges, pixels, weights)
        ridges = _blur(ridges.reshape(orientation.shape), 0.8).ravel()
    return np.asarray(np.clip(1.3 * ridges.reshape(orientation.shape), -1, 1))


def tap_pixels(angle: Field, period: Field, taps: Array) -> list[NDArray[np.intp]]:
    """Return, a tap, the flat index of the pixel that many periods away in direction `angle`."""
    rows, columns = angle.shape
    y, x = np.mgrid[:rows, :columns]
    dx, dy = period * np.cos(angle), -period * np.sin(angle)
    indices = []
    for tap in taps:
        column = np.clip(np.rint(x + tap * dx), 0, columns - 1).astype(np.intp)
        row = np.clip(np.rint(y + tap * dy), 0, rows - 1).astype(np.intp)
        indices.append((row * columns + column).ravel())
    return indices


def _weighted_sum(values: Field, pixels: list[NDArray[np.intp]], weights: Array) -> Field:
    total = np.zeros_like(values)
    for index, weight in zip(pixels, weights.astype(np.float32), strict=True):
        total += weight * values[index]
    return total


# --- its true minutiae --------------------------------------------------------------------------

MARGIN: Final = 9  # about one ridge period: nothing is read nearer the master's border
MIN_SPACING: Final = 7.0  # two minutiae nearer than this are one flaw: a spur, a dot, a pin-hole


def true_minutiae(relief: Field, orientation: Field) -> Minutiae:
    """List the minutiae of a clean relief, by crossing numbers on the skeleton of its ridges."""
    skeleton = np.asarray(skeletonize(relief > 0), np.bool_)  # type: ignore[no-untyped-call]
    crossing = crossing_numbers(skeleton)
    inside = np.pad(np.ones(np.subtract(MASTER_SHAPE, 2 * MARGIN), bool), MARGIN)
    found = np.argwhere(skeleton & inside & ((crossing == 1) | (crossing == 3)))
    apart = np.hypot(*(found[:, None] - found[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    found = found[apart.min(axis=1) >= MIN_SPACING]
    row, column = found.T
    return Minutiae(
        x=column.astype(np.float32),
        y=row.astype(np.float32),
        angle=np.array([minutia_direction(skeleton, r, c, orientation) for r, c in found]),
        kind=np.where(crossing[row, column] == 1, MinutiaKind.ENDING, MinutiaKind.BIFURCATION),
    )


def crossing_numbers(skeleton: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return half the number of changes from pixel to pixel around each pixel."""
    padded = np.pad(skeleton, 1).astype(np.int64)
    rows, columns = skeleton.shape
    ring = ((0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0), (0, 0))
    around = np.stack([padded[top : top + rows, left : left + columns] for top, left in ring])
    return np.asarray(np.abs(around - np.roll(around, 1, axis=0)).sum(axis=0) // 2)


def minutia_direction(
    skeleton: NDArray[np.bool_], row: int, column: int, orientation: Field
) -> float:
    """Return the direction of one minutia in radians, by the convention of `fpmatch.minutiae`.

    The ridge orientation gives the axis. The side that holds more of the skeleton connected to
    the minutia gives the sense: an ending's one branch, or two of a bifurcation's three.
    """
    window = skeleton[row - MARGIN : row + MARGIN + 1, column - MARGIN : column + MARGIN + 1]
    _, label = cv2.connectedComponents(window.astype(np.uint8), connectivity=8)
    below, right = np.nonzero(label == label[MARGIN, MARGIN])
    axis = float(orientation[row, column])
    ahead = (right - MARGIN) * math.cos(axis) - (below - MARGIN) * math.sin(axis)
    return axis if np.sign(ahead).sum() > 0 else axis + math.pi


# --- how it touches the sensor ------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Conditions:
    """Set the ranges from which one kind of impression is drawn; signs are drawn apart."""

    name: str = "easy"
    rotation_deg: Range = (0, 6)
    shift: Range = (0, 12)  # pixels, along each axis
    scale: Range = (0.99, 1.01)
    torsion_deg: Range = (0, 2)  # how far the pressed skin turns against the rest
    traction: Range = (0, 3)  # and slides, pixels
    off_centre: Range = (0, 10)  # pixels from the middle of the finger to that of the contact
    contact: Range = (0.95, 1.05)  # size of the contact, share of the pad
    dryness: Range = (-0.15, 0.2)  # relief below which nothing prints; negative is wet
    unevenness: float = 0.15  # standard deviation of the dryness over the print
    grain: float = 0.25  # roughness that this impression does not share, in units of relief
    max_scratches: int = 1
    max_patches: int = 1  # spots too wet or too dry


CONDITIONS: Final = (  # impressions take them in turn
    Conditions(),
    Conditions(),
    Conditions(
        name="turned",
        rotation_deg=(15, 25),
        shift=(10, 30),
        scale=(0.98, 1.02),
        torsion_deg=(2, 6),
        traction=(2, 7),
        off_centre=(10, 30),
        contact=(0.9, 1.05),
        dryness=(-0.25, 0.3),
        unevenness=0.22,
        grain=0.32,
        max_scratches=3,
        max_patches=2,
    ),
    Conditions(
        name="partial and worn",
        rotation_deg=(4, 15),
        shift=(15, 40),
        scale=(0.98, 1.02),
        torsion_deg=(1, 4),
        traction=(1, 5),
        off_centre=(30, 50),
        contact=(0.75, 0.9),
        dryness=(0.25, 0.45),
        unevenness=0.3,
        grain=0.45,
        max_scratches=4,
        max_patches=4,
    ),
)
STICKING_RADIUS: Final = 0.35  # share of the contact that does not slide
STRETCH_ITERATIONS: Final = 30


@dataclass(frozen=True, slots=True)
class Touch:
    """Hold the true geometry of one impression; points are of the sensor unless named otherwise."""

    placement: Similarity  # from the master to the sensor, before the skin stretches
    centre: Array  # of the contact, shape (2,), pixels
    half_axes: Array
    torsion: float  # turn of the skin outside the firmly pressed middle, radians
    traction: Array  # and its slide, shape (2,), pixels

    def radius(self, points: Array) -> Array:
        """Return how far out `points` (N, 2) lie: 0 in the middle, 1 on the outline."""
        upright = (points - self.centre) @ _rotation(-self.placement.rotation).T
        return np.asarray(np.hypot(*(upright / self.half_axes).T))

    def stretch(self, points: Array) -> Array:
        """Return how far the skin at `points` (N, 2) was dragged (Cappelli et al. 2001).

        The middle sticks to the glass; further out the skin turns and slides more and more.
        """
        brake = 0.5 * (1 - np.cos(np.pi * np.clip(self.radius(points) - STICKING_RADIUS, 0, 1)))
        away = points - self.centre
        return np.asarray(
            brake[:, None] * (away @ _rotation(self.torsion).T - away + self.traction)
        )

    def to_master(self, points: Array) -> Array:
        """Map `points` (N, 2) to the master."""
        return self.placement.inverse().apply(points - self.stretch(points))

    def from_master(self, points: Array) -> Array:
        """Map master `points` (N, 2) to the sensor: `to_master` solved by fixed-point iteration."""
        placed = reached = self.placement.apply(points)
        for _ in range(STRETCH_ITERATIONS):
            reached = placed + self.stretch(reached)
        return reached


def draw_touch(conditions: Conditions, rng: np.random.Generator) -> Touch:
    """Draw where and how the finger touches the sensor."""
    rotation = math.radians(rng.uniform(*conditions.rotation_deg)) * rng.choice((-1, 1))
    scale = rng.uniform(*conditions.scale)
    shift = rng.uniform(*conditions.shift, 2) * rng.choice((-1, 1), 2)
    master_middle, sensor_middle = (np.array(s[::-1]) / 2 for s in (MASTER_SHAPE, SENSOR_SHAPE))
    tx, ty = sensor_middle + shift - scale * _rotation(rotation) @ master_middle
    placement = Similarity(scale, rotation, float(tx), float(ty))
    off_centre = rng.uniform(*conditions.off_centre) * _direction(rng)
    return Touch(
        placement=placement,
        centre=placement.apply((master_middle + off_centre)[None])[0],
        half_axes=np.array(PAD_HALF_AXES) * rng.uniform(*conditions.contact, 2),
        torsion=math.radians(rng.uniform(*conditions.torsion_deg)) * rng.choice((-1, 1)),
        traction=rng.uniform(*conditions.traction) * _direction(rng),
    )


# --- the impression -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Impression:
    """Hold one picture and the truth about it."""

    image: NDArray[np.uint8]
    conditions: str
    transform: Similarity  # the best one from master to image over the contact
    residual_rms_px: float  # what the stretching of the skin leaves beyond it
    minutiae: Minutiae  # those that can be seen, in pixels of the image
    master: NDArray[np.int64]  # their indices among the master's minutiae


def make_impression(finger: Finger, conditions: Conditions, rng: np.random.Generator) -> Impression:
    """Press `finger` on the sensor once."""
    touch = draw_touch(conditions, rng)
    points = np.argwhere(np.ones(SENSOR_SHAPE))[:, ::-1].astype(np.float64)
    origin, radius = touch.to_master(points), touch.radius(points)
    creases = _sample(finger.creases, origin)
    threshold = print_threshold(radius.reshape(SENSOR_SHAPE), creases, conditions, rng)
    image = develop(_sample(finger.relief, origin), threshold, conditions.grain, rng)
    origin, points = origin[radius < 1], points[radius < 1]
    transform = Similarity.fit(origin, points)
    residual = np.square(points - transform.apply(origin)).sum(axis=1)
    moved = move_minutiae(finger.minutiae, touch)
    seen = np.flatnonzero(is_legible(moved.xy, threshold))
    return Impression(
        image=image,
        conditions=conditions.name,
        transform=transform,
        residual_rms_px=math.sqrt(residual.mean()),
        minutiae=moved.take(seen),
        master=seen,
    )


def move_minutiae(minutiae: Minutiae, touch: Touch) -> Minutiae:
    """Carry the master's minutiae to the sensor; each direction by a point one pixel ahead."""
    start = minutiae.xy.astype(np.float64)
    ahead = start + np.column_stack([np.cos(minutiae.angle), -np.sin(minutiae.angle)])
    start, ahead = touch.from_master(start), touch.from_master(ahead)
    dx, dy = (ahead - start).T.astype(np.float32)
    x, y = start.T.astype(np.float32)
    return replace(minutiae, x=x, y=y, angle=np.arctan2(-dy, dx))


EDGE_START: Final = 0.78  # radius from which the skin lifts off the glass
EDGE_STEEPNESS: Final = 22.0  # relief by which it has lifted one radius further out
CREASE_DEPTH: Final = 3.0  # relief by which creased or scratched skin stays off the glass
WET_PATCH, DRY_PATCH = -1.1, 0.8
PATCH_EXTENT: Final = 18.0
LEGIBLE: Final = 1.0  # a print threshold beyond this fills valleys or loses ridges
BORDER: Final = 7  # nothing is legible nearer the sensor's border


def print_threshold(
    radius: Array, creases: Field, conditions: Conditions, rng: np.random.Generator
) -> Field:
    """Return the relief that skin must have to print, pixel by pixel."""
    shape = radius.shape
    threshold = rng.uniform(*conditions.dryness) + conditions.unevenness * smooth_noise(
        shape, 30.0, rng
    )
    for _ in range(rng.integers(0, conditions.max_patches + 1)):
        spot = np.zeros(shape, np.float32)
        spot[tuple(rng.integers(0, shape))] = 1
        extent = _blur(spot, PATCH_EXTENT)
        blotch = extent / extent.max() * np.clip(smooth_noise(shape, 9.0, rng), 0, 1)
        threshold += rng.choice((WET_PATCH, DRY_PATCH)) * blotch
    ragged = radius + 0.04 * smooth_noise(shape, 8.0, rng)
    threshold += EDGE_STEEPNESS * np.clip(ragged - EDGE_START, 0, None) ** 2
    new = scratches(shape, rng.integers(0, conditions.max_scratches + 1), rng)
    return np.asarray(threshold + CREASE_DEPTH * np.maximum(creases, new), np.float32)


def scratches(shape: tuple[int, ...], count: int | np.int64, rng: np.random.Generator) -> Field:
    """Return `count` thin, slightly bent, tapering lines as a map of 0 (skin) to 1 (none)."""
    lines = np.zeros(shape, np.float32)
    for _ in range(count):
        bends = np.cumsum(rng.normal(scale=0.06, size=rng.integers(5, 20)))
        heading = rng.uniform(-0.6, 0.6) + rng.choice((0, np.pi)) + bends
        steps = 8.0 * np.column_stack([np.cos(heading), np.sin(heading)])
        path = rng.uniform(0.2, 0.8, 2) * shape[::-1] + np.cumsum(steps, axis=0)
        width = int(rng.integers(1, 4))
        taper = np.sin(np.linspace(0.3, np.pi - 0.3, len(path)))
        depth = (taper * rng.uniform(0.7, 1.3, len(path))).tolist()
        ends = np.rint(path).astype(int).tolist()
        for begin, end, value in zip(ends, ends[1:], depth, strict=False):
            cv2.line(lines, begin, end, value, width)
    broken = 0.75 + 0.35 * smooth_noise(shape, 4.0, rng)
    return np.clip(_blur(lines, 1.1) * broken, 0, 1)


def is_legible(points: NDArray[np.floating], threshold: Field) -> NDArray[np.bool_]:
    """Return whether ridges can be told from valleys at `points` (N, 2)."""
    rows, columns = threshold.shape
    x, y = np.rint(points).astype(np.int64).T
    inside = (x >= BORDER) & (x < columns - BORDER) & (y >= BORDER) & (y < rows - BORDER)
    around = _blur(threshold, BORDER / 3)
    at_point = around[np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)]
    return np.asarray(inside & (np.abs(at_point) < LEGIBLE))


# --- the picture --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Sensor:
    """Set how the sensor turns contact into grey levels."""

    softness: float = 0.16  # relief over which an edge goes from paper to ink
    blur: float = 0.6  # point spread, pixels
    paper: float = 253.0
    ink: float = 45.0
    ink_variation: float = 16.0  # standard deviation over the print
    ink_fading: float = 40.0  # grey levels by which drier skin prints lighter, a unit of relief
    ink_range: Range = (10.0, 140.0)
    noise: float = 2.0  # standard deviation of each pixel
    max_specks: int = 5  # of dust


def develop(
    relief: Field,
    threshold: Field,
    grain: float,
    rng: np.random.Generator,
    sensor: Sensor | None = None,
) -> NDArray[np.uint8]:
    """Return the picture that the sensor takes of skin whose relief exceeds the threshold."""
    sensor, shape = sensor or Sensor(), relief.shape
    roughness = 0.7 * smooth_noise(shape, 1.1, rng) + 0.3 * smooth_noise(shape, 2.2, rng)
    contact = (relief + grain * roughness - threshold) / sensor.softness
    covered = np.maximum(1 / (1 + np.exp(-np.clip(contact, -30, 30))), dust(shape, sensor, rng))
    ink = sensor.ink + sensor.ink_variation * smooth_noise(shape, 18.0, rng)
    ink = np.clip(ink + sensor.ink_fading * threshold, *sensor.ink_range)
    grey = sensor.paper - _blur(covered, sensor.blur) * (sensor.paper - ink)
    grey += sensor.noise * rng.standard_normal(shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def dust(shape: tuple[int, ...], sensor: Sensor, rng: np.random.Generator) -> Field:
    """Return bits of dust on the glass, 0 to 1."""
    specks = np.zeros(shape, np.float32)
    for _ in range(rng.integers(0, sensor.max_specks + 1)):
        centre, half_axes = rng.integers(0, shape[::-1]).tolist(), rng.integers(1, 3, 2).tolist()
        tilt, strength = rng.uniform(0, 180), rng.uniform(0.2, 0.7)
        cv2.ellipse(specks, centre, half_axes, tilt, 0, 360, strength, -1)
    return _blur(specks, 0.7)


def smooth_noise(shape: tuple[int, ...], extent: float, rng: np.random.Generator) -> Field:
    """Return smooth random values, mean 0 and standard deviation 1, that vary over `extent` px."""
    noise = _blur(rng.standard_normal(shape), extent)
    return np.asarray((noise - noise.mean()) / noise.std(), np.float32)


def _blur(image: NDArray[np.floating], sigma: float) -> Field:
    return np.asarray(cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma), np.float32)


def _sample(layer: Field, points: Array) -> Field:
    """Return `layer` of the master at `points`, one a pixel of the sensor."""
    at = points.reshape(*SENSOR_SHAPE, 2).astype(np.float32)
    sampled = cv2.remap(
        layer, at[..., 0], at[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(sampled, np.float32)


def _rotation(angle: float) -> Array:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine], [sine, cosine]])


def _direction(rng: np.random.Generator) -> Array:
    angle = rng.uniform(0, 2 * np.pi)
    return np.array([math.cos(angle), math.sin(angle)])


# --- the files ----------------------------------------------------------------------------------


def make_impressions(number: int, count: int, seed: int) -> tuple[Finger, list[Impression]]:
    """Return finger `number` (from 0) and `count` impressions of it."""
    finger = make_finger(number, seed)
    return finger, [
        make_impression(
            finger, CONDITIONS[m % len(CONDITIONS)], np.random.default_rng([seed, number, m])
        )
        for m in range(count)
    ]


def write_dataset(folder: Path, fingers: int, impressions: int, seed: int) -> None:
    """Write ``FFF_M.tif``, ``dataset.toml`` and ``truth.json`` into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    of_fingers: dict[str, Any] = {}
    of_impressions: dict[str, Any] = {}
    for number in range(fingers):
        finger, pressed = make_impressions(number, impressions, seed)
        name = str(FIRST_FINGER + number)
        of_fingers[name] = {"pattern": finger.pattern, "minutiae": columns_of(finger.minutiae)}
        for m, impression in enumerate(pressed, start=1):
            of_impressions[f"{name}_{m}"] = truth_of(impression)
            Image.fromarray(impression.image).save(
                folder / f"{name}_{m}.tif", dpi=(DPI, DPI), compression="tiff_lzw"
            )
    description = f'name = "synthetic, seed {seed}"\ndpi = {DPI}\nsensor = "synthetic"\n'
    (folder / "dataset.toml").write_text(description, encoding="utf-8")
    truth = {
        "seed": seed,
        "dpi": DPI,
        "master_size": MASTER_SHAPE[::-1],
        "image_size": SENSOR_SHAPE[::-1],
        "fingers": of_fingers,
        "impressions": of_impressions,
    }
    (folder / "truth.json").write_text(_json(truth) + "\n", encoding="utf-8")


def truth_of(impression: Impression) -> dict[str, Any]:
    """Return what ``truth.json`` says of one impression."""
    transform = impression.transform
    return {
        "conditions": impression.conditions,
        "transform": {
            "scale": round(transform.scale, 6),
            "rotation": round(transform.rotation, 6),
            "rotation_deg": round(transform.rotation_deg, 4),
            "tx": round(transform.tx, 4),
            "ty": round(transform.ty, 4),
        },
        "residual_rms_px": round(impression.residual_rms_px, 3),
        "minutiae": columns_of(impression.minutiae) | {"master": impression.master.tolist()},
    }


def columns_of(minutiae: Minutiae) -> dict[str, list[float]]:
    """Return minutiae as columns: x and y in pixels, direction in degrees, ISO kind."""
    degrees = np.degrees(minutiae.angle.astype(np.float64))
    return {
        "x": minutiae.x.astype(np.float64).round(2).tolist(),
        "y": minutiae.y.astype(np.float64).round(2).tolist(),
        "angle_deg": (degrees.round(2) % 360).tolist(),
        "kind": minutiae.kind.tolist(),
    }


def _json(value: Any, indent: str = "\n") -> str:
    """Return `value` as JSON with one member of an object a line, lists on one line."""
    if not isinstance(value, dict):
        return json.dumps(value)
    inner = indent + " "
    members = (f"{inner}{json.dumps(key)}: {_json(value[key], inner)}" for key in value)
    return "{" + ",".join(members) + indent + "}"


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("must be at least 1")
    return value


def main() -> None:
    """Write the folder that the command line asks for; by default the project's own."""
    parser = argparse.ArgumentParser(description="Make FVC-style synthetic fingerprint images.")
    parser.add_argument("--out", type=Path, default=DEFAULT_FOLDER, help="default: sample_data")
    parser.add_argument("--fingers", type=_count, default=4, help="default: %(default)s")
    parser.add_argument("--impressions", type=_count, default=4, help="of each; default: 4")
    parser.add_argument("--seed", type=int, default=DEFAULT_SEED, help="default: %(default)s")
    arguments = parser.parse_args()
    write_dataset(arguments.out, arguments.fingers, arguments.impressions, arguments.seed)


if __name__ == "__main__":
    main()
