"""The class, the singular points and the ridge orientation of a master print.

The orientation is that of the singular points, of arching flanks, and of random variation.

References
----------
Cappelli, Erol, Maio, Maltoni, "Synthetic fingerprint-image generation", ICPR 2000 (SFinGe), for
the steps and the arch.
Sherlock, Monro, "A model for interpreting fingerprint topology", Pattern Recognition 26 (1993):
the orientation turns by half the argument around every core and back around every delta.
Vizcaya, Gerhardt, "A nonlinear orientation model for global description of fingerprints",
Pattern Recognition 29 (1996): each argument passes through a piecewise-linear function first.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.lab.synthesis.noise import smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Field = NDArray[np.float64]

Range = tuple[float, float]


class PatternClass(StrEnum):
    """Class of a print."""

    ARCH = "arch"
    TENTED_ARCH = "tented arch"
    LEFT_LOOP = "left loop"
    RIGHT_LOOP = "right loop"
    WHORL = "whorl"


NATURAL_SHARES: Final = {  # of all fingers, Wilson, Candela, Watson 1994
    PatternClass.ARCH: 0.037,
    PatternClass.TENTED_ARCH: 0.029,
    PatternClass.LEFT_LOOP: 0.338,
    PatternClass.RIGHT_LOOP: 0.317,
    PatternClass.WHORL: 0.279,
}


class SingularRanges(NamedTuple):
    """Set the rectangles that contain the singular points of one class.

    Each is a range of x and one of y in pixels from the middle of the fingertip, y up.
    """

    cores: tuple[tuple[Range, Range], ...] = ()
    deltas: tuple[tuple[Range, Range], ...] = ()


_LEFT_LOOP: Final = SingularRanges(
    cores=(((-25, 25), (5, 65)),), deltas=(((75, 140), (-165, -75)),)
)
SINGULAR_RANGES: Final = {
    PatternClass.ARCH: SingularRanges(),
    PatternClass.TENTED_ARCH: SingularRanges(
        cores=(((-10, 10), (5, 45)),), deltas=(((-12, 12), (-90, -45)),)
    ),
    PatternClass.LEFT_LOOP: _LEFT_LOOP,
    PatternClass.RIGHT_LOOP: _LEFT_LOOP,  # mirrored
    PatternClass.WHORL: SingularRanges(
        cores=(((-24, 12), (40, 80)), ((-10, 26), (-35, 15))),
        deltas=(((-140, -85), (-165, -85)), ((85, 140), (-165, -85))),
    ),
}


class SingularPoints(NamedTuple):
    """Positions of the singular points of one print, (K, 2), in pixels, x right and y down."""

    cores: NDArray[np.float64]
    deltas: NDArray[np.float64]


def draw_pattern(rng: np.random.Generator) -> PatternClass:
    """Draw a class in the natural proportions."""
    classes = list(NATURAL_SHARES)
    limits = np.cumsum(list(NATURAL_SHARES.values()))
    return classes[int(np.searchsorted(limits, rng.random() * limits[-1], side="right"))]


def draw_singular_points(
    pattern: PatternClass, centre: tuple[float, float], rng: np.random.Generator, size: float = 1.0
) -> SingularPoints:
    """Draw the singular points of a finger: none for an arch, two of each for a whorl, else one.

    `centre` is the middle of the fingertip, x and y in pixels; `size` is relative to an average
    finger.
    """
    ranges = SINGULAR_RANGES[pattern]
    always, never = pattern is PatternClass.RIGHT_LOOP, pattern is PatternClass.LEFT_LOOP
    mirrored = (rng.random() < 0.5 or always) and not never
    flip = np.array([-1.0 if mirrored else 1.0, -1.0]) * size  # y up becomes y down
    drawn = (
        np.array([[rng.uniform(*x), rng.uniform(*y)] for x, y in rectangles]).reshape(-1, 2)
        for rectangles in ranges
    )
    return SingularPoints(*(np.asarray(centre) + flip * points for points in drawn))


ORIENTATION_LEVELS: Final = 2048
"""Orientations are whole multiples of π over this, so that rounding differs on no machine."""
_UP: Final = math.pi / 2


class Arching(NamedTuple):
    """Set how the ridges of one class arch, in addition to the effect of singular points."""

    steepness_deg: Range  # of the flanks
    half_width_px: Range  # position on either side of the middle


ARCHING: Final = {
    PatternClass.ARCH: Arching((40.0, 56.0), (66.0, 88.0)),
    PatternClass.TENTED_ARCH: Arching((30.0, 42.0), (85.0, 105.0)),
    PatternClass.LEFT_LOOP: Arching((28.0, 42.0), (105.0, 125.0)),
    PatternClass.RIGHT_LOOP: Arching((28.0, 42.0), (105.0, 125.0)),
    PatternClass.WHORL: Arching((28.0, 40.0), (105.0, 125.0)),
}


# The deviation from the plain zero-pole model; lengths at size 1.
CORNER_COUNT: Final = 8  # of each piecewise-linear correction of an argument
CORRECTION_DEG: Final = 7.0  # standard deviation at a corner, of any correction
UPRIGHTNESS: Final = (0.3, 0.8)  # rotation of a loop's axis to the vertical by its delta
LOOP_NARROWING_DEG: Final = (16.0, 44.0)  # inclination of a core's flanks towards its axis
VARIATION_DEG: Final = (2.5, 5.0)  # standard deviation of the random part
VARIATION_EXTENT_PX: Final = 34.0
JOINT_PX: Final = 105.0  # distance below the middle at which arches are half as steep
JOINT_SOFTNESS_PX: Final = 32.0
WIDENING_PX: Final = 400.0  # distance above the middle at which arches are twice as wide


def ridge_orientation(
    pattern: PatternClass,
    points: SingularPoints,
    shape: tuple[int, int],
    rng: np.random.Generator,
    size: float,
) -> NDArray[np.float32]:
    """Draw the ridge orientation field of one finger, (rows, columns).

    Radians in [0, π), counter-clockwise on screen from +x. `points` are in pixels; `size` is
    relative to an average finger.
    """
    rows, columns = shape
    y, x = np.mgrid[rows / 2 : -rows / 2 : -1, -columns / 2 : columns / 2]
    cores, deltas = (
        [complex(x - columns / 2, rows / 2 - y) for x, y in xy]
        for xy in (points.cores, points.deltas)
    )
    turning = zero_pole_turning(x + 1j * y, cores, deltas, rng)
    arching = _arching(x / size, y / size, ARCHING[pattern], rng)
    variation = math.radians(rng.uniform(*VARIATION_DEG))
    angle = turning + arching + variation * smooth_noise(shape, VARIATION_EXTENT_PX, rng)
    level = np.mod(np.rint(angle * (ORIENTATION_LEVELS / np.pi)), ORIENTATION_LEVELS)
    return np.asarray(level * (np.pi / ORIENTATION_LEVELS), np.float32)


def _arching(x: Field, y: Field, arching: Arching, rng: np.random.Generator) -> Field:
    """Return the additional angle of ridges left and right of the middle, in radians."""
    steepness = math.radians(rng.uniform(*arching.steepness_deg))
    u = x / (rng.uniform(*arching.half_width_px) * (1 + np.clip(y / WIDENING_PX, 0, None)))
    above_joint = 1 / (1 + np.exp(-(y + JOINT_PX) / JOINT_SOFTNESS_PX))
    return np.asarray(-steepness * u * np.exp((1 - u**2) / 2) * above_joint)


class _Turn(NamedTuple):
    """One singular point, and the share of its corrected argument by which ridges turn."""

    place: complex
    share: float
    correction: Field  # of the argument, at corners evenly spaced around the point

    def around(self, place: NDArray[np.complex128]) -> Field:
        """Return the turning of the ridges by this point at `place`, in radians."""
        argument = np.angle(place - self.place)
        values = np.append(self.correction, self.correction[0])
        corners = np.linspace(0, 2 * np.pi, values.size)
        bent = argument + np.interp(np.mod(argument, 2 * np.pi), corners, values)
        return np.asarray(self.share * bent, np.float64)


def zero_pole_turning(
    place: NDArray[np.complex128],
    cores: list[complex],
    deltas: list[complex],
    rng: np.random.Generator,
) -> Field:
    """Draw the rotation of ridges from the horizontal by the singular points, (H, W).

    Radians, counter-clockwise, modulo π. Points and `place` (H, W) are x + iy, y up. Besides random
    corrections, deltas are bent so that loops are more upright than in the plain model, and cores
    so that the two legs of a loop are nearly parallel.
    """
    corners = np.arange(CORNER_COUNT) * (2 * np.pi / CORNER_COUNT)
    jitter = math.radians(CORRECTION_DEG) * rng.standard_normal((10, CORNER_COUNT))
    uprightness = rng.uniform(*UPRIGHTNESS)
    narrowing = math.radians(rng.uniform(*LOOP_NARROWING_DEG))
    turns = [_Turn(core, 0.5, bend) for core, bend in zip(cores, jitter, strict=False)]
    for delta, bend in zip(deltas, jitter[len(cores) :], strict=False):
        to_cores = float(np.angle(sum(cores) / len(cores) - delta)) if cores else _UP
        lean = uprightness * (to_cores - _UP) * np.clip(np.cos(corners - to_cores), 0, 1)
        turns.append(_Turn(delta, -0.5, bend - lean))
    total = np.zeros(place.shape)
    for turn in turns:
        narrowed = turn
        if turn.share > 0:
            here = np.array([turn.place])
            opening = 2 * sum(float(o.around(here)[0]) for o in turns if o is not turn)
            closer = narrowing * np.sin(corners - opening)
            narrowed = turn._replace(correction=turn.correction - closer)
        total += narrowed.around(place)
    return total
