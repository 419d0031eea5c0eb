"""The geometry of one impression: the map from the master to the image.

References
----------
Cappelli, Maio, Maltoni, "Modelling plastic distortion in fingerprint images", ICAPR 2001.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.pointset.geometry.points import as_points
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.lab.synthesis.orientation import Range

    Points = NDArray[np.float64]  # shape (N, 2), x and y
    Pair = tuple[float, float]
    Wave = tuple[float, float, float, float, float]  # shift, wave vector a pixel, phase

STICKING_RADIUS: Final = 0.35  # radius of the contact that does not slide
STEEPEST: Final = 0.97  # of a warp with waves, so that skin does not fold
WAVES: Final = 4
WAVE_LENGTH_PX: Final = (90.0, 700.0)  # at 500 dpi
SOLVED_PX: Final = 1e-7  # largest step of a point when `from_master` stops
_MOST_ROUNDS: Final = 500  # never reached unless skin folds


@dataclass(frozen=True, slots=True)
class Warp:
    """Map the master to the image: placed on the sensor, then dragged over it.

    The firmly pressed middle of the contact sticks to the glass. Around it the skin slips, the more
    the further out; beyond, it follows the finger, which turns and slides as a whole.
    """

    placement: Similarity  # before the finger moves; its scale includes the resolution
    centre: Pair  # of the contact ellipse, in pixels of the image
    half_axes: Pair  # across and along the finger
    torsion: float = 0.0  # of the finger after it touched, radians, clockwise on screen
    traction: Pair = (0.0, 0.0)  # its slide, x and y in pixels of the image
    waves: tuple[Wave, ...] = ()  # of skin that is compressed in some places, stretched in others

    @property
    def steepness(self) -> float:
        """Largest difference of the drag between two points, as a share of their distance.

        From 1 on, the skin would fold over itself.
        The share of slip rises by at most π/2 a unit of radius. Distance from the centre times
        slope of the radius is at most the radius times (a/b + b/a) / 2 (Kantorovich).
        """
        a, b = self.half_axes
        turn = 2 * abs(math.sin(self.torsion / 2))
        by_turn = turn * (1 + STICKING_RADIUS) * (a / b + b / a) / 2
        by_slide = math.hypot(*self.traction) / min(a, b)
        by_waves = sum(math.hypot(dx, dy) * math.hypot(kx, ky) for dx, dy, kx, ky, _ in self.waves)
        return turn + 0.5 * math.pi * (by_turn + by_slide) + by_waves

    def upright(self, points: ArrayLike) -> Points:
        """Return `points` (N, 2) across and along the finger, in half axes."""
        turned = (as_points(points) - self.centre) @ _rotation(-self.placement.rotation).T
        return np.asarray(turned / self.half_axes)

    def drag(self, points: ArrayLike) -> Points:
        """Return the drag of the skin at `points` (N, 2), in pixels."""
        p = as_points(points)
        slip = np.clip(np.hypot(*self.upright(p).T) - STICKING_RADIUS, 0, 1)
        share = 0.5 * (1 - np.cos(np.pi * slip))
        away = p - self.centre
        moved = away @ _rotation(self.torsion).T - away + self.traction
        moved *= share[:, None]
        for dx, dy, kx, ky, phase in self.waves:
            moved += np.sin(away @ (kx, ky) + phase)[:, None] * (dx, dy)
        return np.asarray(moved)

    def to_master(self, points: ArrayLike) -> Points:
        """Map `points` (N, 2) of the image to the master."""
        p = as_points(points)
        return self.placement.inverse().apply(p - self.drag(p))

    def from_master(self, points: ArrayLike) -> Points:
        """Map `points` (N, 2) of the master to the image: the inverse of `to_master`."""
        return solved(self.placement.apply(points), self.drag, SOLVED_PX)


def solved(goal: Points, drag: Callable[[Points], Points], tolerance: float) -> Points:
    """Return the points (N, 2) that `drag` takes from `goal`, by fixed-point iteration.

    Steps shrink by a constant factor wherever skin does not fold; `tolerance` ends them, in pixels.
    """
    reached = goal
    for _ in range(_MOST_ROUNDS):
        before, reached = reached, goal + drag(reached)
        if np.abs(reached - before).max(initial=0.0) < tolerance:
            break
    return reached


@dataclass(frozen=True, slots=True)
class PlacementParameters:
    """Set how fingers are placed; lengths in pixels at 500 dpi; signs are drawn separately."""

    rotation_deg: Range = (0.0, 6.0)
    shift: Range = (0.0, 12.0)  # along each axis
    scale: Range = (0.99, 1.01)
    torsion_deg: Range = (0.0, 2.0)
    traction: Range = (0.0, 3.0)
    off_centre: Range = (0.0, 10.0)  # from the middle of the finger to that of the contact
    half_width: Range = (112.0, 132.0)  # of the contact
    elongation: Range = (1.35, 1.6)  # ratio of height to width
    tip_only: float = 0.0  # probability that only a side or the tip touches
    tip_off_centre: Range = (60.0, 110.0)
    tip_size: Range = (0.75, 0.95)  # of that contact relative to others
    cut_off: float = 0.0  # probability that the finger reaches far beyond the sensor
    cut_shift: Range = (0.22, 0.42)  # then from the middle, shares of the sides
    strain: Range = (0.0, 0.0)  # largest local change of a length, as a share of it


def draw_warp(
    master_shape: tuple[int, int],
    sensor_shape: tuple[int, int],
    dpi: float,
    rng: np.random.Generator,
    p: PlacementParameters,
) -> Warp:
    """Draw where and how a finger touches a sensor.

    Shapes are rows and columns of the master, which has 500 dpi, and of the image, which has `dpi`.
    """
    px = dpi / STANDARD_DPI
    rotation = math.radians(rng.uniform(*p.rotation_deg)) * rng.choice((-1, 1))
    scale = px * rng.uniform(*p.scale)
    shift = px * rng.uniform(*p.shift, 2) * rng.choice((-1, 1), 2)
    middle_of_master, middle_of_sensor = (
        np.array(shape[::-1]) / 2 for shape in (master_shape, sensor_shape)
    )
    only_the_tip, cut_off = rng.random(2) < (p.tip_only, p.cut_off)
    towards = rng.uniform(*(p.tip_off_centre if only_the_tip else p.off_centre)) * _direction(rng)
    over_the_border = rng.uniform(*p.cut_shift) * 2 * middle_of_sensor * _direction(rng)
    if cut_off:
        shift = over_the_border
    torsion = math.radians(rng.uniform(*p.torsion_deg)) * rng.choice((-1, 1))
    traction = px * rng.uniform(*p.traction) * _direction(rng)
    half_width = px * rng.uniform(*p.half_width)
    if only_the_tip:
        half_width *= rng.uniform(*p.tip_size)
    half_height = half_width * rng.uniform(*p.elongation)
    # the contact is about the middle of the sensor, whichever part of the finger touches
    centre = middle_of_sensor + shift
    tx, ty = centre - scale * _rotation(rotation) @ (middle_of_master + towards)
    placement = Similarity(scale, rotation, float(tx), float(ty))
    middle, slide = (float(centre[0]), float(centre[1])), (float(traction[0]), float(traction[1]))
    warp = Warp(placement, middle, (half_width, half_height), torsion, slide)
    if not any(p.strain):
        return warp
    strain = min(rng.uniform(*p.strain), max(0.0, STEEPEST - warp.steepness))
    return replace(warp, waves=_draw_waves(strain, px, rng))


def _draw_waves(strain: float, px: float, rng: np.random.Generator) -> tuple[Wave, ...]:
    """Draw waves of compressed and stretched skin of `strain` in all."""
    shares = rng.dirichlet(np.ones(WAVES))
    waves = []
    shortest, longest = map(math.log, WAVE_LENGTH_PX)
    lengths = px * np.exp(rng.uniform(shortest, longest, WAVES))
    for share, length in zip(shares, lengths, strict=True):
        k = 2 * math.pi / length * _direction(rng)
        shift = strain * share * length / (2 * math.pi) * _direction(rng)
        waves.append((*shift.tolist(), *k.tolist(), rng.uniform(0, 2 * math.pi)))
    return tuple(waves)


def _rotation(angle: float) -> NDArray[np.float64]:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine], [sine, cosine]])


def _direction(rng: np.random.Generator) -> NDArray[np.float64]:
    angle = rng.uniform(0, 2 * math.pi)
    return np.array([math.cos(angle), math.sin(angle)])
