"""The ridge orientation of a master print: singular points, arching flanks, and variation.

References
----------
Cappelli, Erol, Maio, Maltoni, "Synthetic fingerprint-image generation", ICPR 2000 (SFinGe), for
the steps and the arch; `fpmatch.synthesis.zero_pole` for cores and deltas.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.synthesis.classes import PatternClass, Range, SingularPoints
from fpmatch.synthesis.noise import smooth_noise
from fpmatch.synthesis.zero_pole import ZeroPoleParameters, zero_pole_turning

if TYPE_CHECKING:
    from numpy.typing import NDArray

ORIENTATION_LEVELS: Final = 2048
"""Orientations are whole multiples of π over this, so that rounding differs on no machine."""


@dataclass(frozen=True, slots=True)
class Arching:
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


@dataclass(frozen=True, slots=True)
class OrientationParameters:
    """Set the deviation from the plain zero-pole model; lengths at size 1."""

    zero_pole: ZeroPoleParameters = field(default_factory=ZeroPoleParameters)
    variation_deg: Range = (2.5, 5.0)  # standard deviation of the random part
    variation_extent_px: float = 34.0
    joint_px: float = 105.0  # distance below the middle at which arches are half as steep
    joint_softness_px: float = 32.0
    widening_px: float = 400.0  # distance above the middle at which arches are twice as wide


def ridge_orientation(
    pattern: PatternClass,
    points: SingularPoints,
    shape: tuple[int, int],
    rng: np.random.Generator,
    parameters: OrientationParameters | None = None,
    *,
    size: float = 1.0,
) -> NDArray[np.float32]:
    """Draw the ridge orientation field of one finger, (rows, columns).

    Radians in [0, π), counter-clockwise on screen from +x. `points` are in pixels; `size` is
    relative to an average finger.
    """
    p = parameters or OrientationParameters()
    rows, columns = shape
    y, x = np.mgrid[rows / 2 : -rows / 2 : -1, -columns / 2 : columns / 2]
    cores, deltas = (_from_middle(xy, shape) for xy in (points.cores, points.deltas))
    turning = zero_pole_turning(x + 1j * y, cores, deltas, rng, p.zero_pole)
    arching = _arching(x / size, y / size, ARCHING[pattern], rng, p)
    variation = math.radians(rng.uniform(*p.variation_deg))
    angle = turning + arching + variation * smooth_noise(shape, p.variation_extent_px, rng)
    level = np.mod(np.rint(angle * (ORIENTATION_LEVELS / np.pi)), ORIENTATION_LEVELS)
    return np.asarray(level * (np.pi / ORIENTATION_LEVELS), np.float32)


def _arching(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    arching: Arching,
    rng: np.random.Generator,
    p: OrientationParameters,
) -> NDArray[np.float64]:
    """Return the additional angle of ridges left and right of the middle, in radians."""
    steepness = math.radians(rng.uniform(*arching.steepness_deg))
    u = x / (rng.uniform(*arching.half_width_px) * (1 + np.clip(y / p.widening_px, 0, None)))
    above_joint = 1 / (1 + np.exp(-(y + p.joint_px) / p.joint_softness_px))
    return np.asarray(-steepness * u * np.exp((1 - u**2) / 2) * above_joint)


def _from_middle(xy: NDArray[np.float64], shape: tuple[int, int]) -> list[complex]:
    """Return pixel positions as x + iy from the middle of the print, y up."""
    return [complex(x - shape[1] / 2, shape[0] / 2 - y) for x, y in xy]
