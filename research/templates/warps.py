"""Where and how the fingers of many impressions touch the sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.lab.synthesis.warp import STICKING_RADIUS
from research.templates.numbers import between, uniform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.sensor import Sensor
    from fpmatch.lab.synthesis.warp import PlacementParameters
    from research.templates.numbers import Doubles

_ROUNDS: Final = 8  # of the inverse of a warp


class Warps(NamedTuple):
    """Where and how fingers touch: maps as `fpmatch.lab.synthesis.warp.Warp`, (B, 1) each."""

    x: Doubles
    y: Doubles
    half_width: Doubles
    half_height: Doubles
    cosine: Doubles  # of the rotation
    sine: Doubles
    scale: Doubles
    tx: Doubles
    ty: Doubles
    torsion_cosine: Doubles
    torsion_sine: Doubles
    dx: Doubles  # the slide
    dy: Doubles

    def upright(self, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
        """Return places across and along the finger, in half axes."""
        ax, ay = x - self.x, y - self.y
        c, s = self.cosine, self.sine
        return (c * ax + s * ay) / self.half_width, (c * ay - s * ax) / self.half_height

    def drag(self, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
        """Return the drag of the skin at places."""
        ux, uy = self.upright(x, y)
        slip = np.clip(np.sqrt(ux * ux + uy * uy) - STICKING_RADIUS, 0, 1)
        t = slip * slip * (np.pi / 2) ** 2
        s = np.pi / 2 * slip * (1 - t / 6 * (1 - t / 20 * (1 - t / 42 * (1 - t / 72))))
        share = np.where(slip >= 1, 1.0, s * s)
        ax, ay, c, s = x - self.x, y - self.y, self.torsion_cosine, self.torsion_sine
        return share * (c * ax - s * ay - ax + self.dx), share * (s * ax + c * ay - ay + self.dy)

    def to_master(self, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
        """Map places of the images to the masters."""
        dx, dy = self.drag(x, y)
        x, y = x - (dx + self.tx), y - (dy + self.ty)
        c, s = self.cosine, self.sine
        return (c * x + s * y) / self.scale, (c * y - s * x) / self.scale

    def from_master(self, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
        """Map places of the masters to the images."""
        c, s = self.cosine, self.sine
        gx, gy = self.scale * (c * x - s * y) + self.tx, self.scale * (s * x + c * y) + self.ty
        x, y = gx, gy
        for _ in range(_ROUNDS):
            dx, dy = self.drag(x, y)
            x, y = gx + dx, gy + dy
        return x, y


def draw_warps(
    keys: NDArray[np.uint64], master_shape: tuple[int, int], sensor: Sensor, p: PlacementParameters
) -> Warps:
    """Draw where and how fingers touch, as `fpmatch.lab.synthesis.warp.draw_warp`."""
    u = uniform(keys, 22).astype(np.float64)
    px = sensor.px
    sign = np.where(u[:, :4] < 0.5, -1.0, 1.0)
    rotation = np.radians(between(p.rotation_deg, u[:, 4])) * sign[:, 0]
    scale = px * between(p.scale, u[:, 5])
    middle = np.array(sensor.shape[::-1]) / 2
    shift = px * between(p.shift, u[:, 6:8]) * sign[:, 1:3]
    tip, cut = u[:, 8] < p.tip_only, u[:, 9] < p.cut_off
    off = np.where(tip, between(p.tip_off_centre, u[:, 10]), between(p.off_centre, u[:, 10]))
    towards = off[:, None] * directions(u[:, 11])
    beyond = between(p.cut_shift, u[:, 12])[:, None] * 2 * middle * directions(u[:, 13])
    shift = np.where(cut[:, None], beyond, shift)
    torsion = np.radians(between(p.torsion_deg, u[:, 14])) * sign[:, 3]
    slide = px * between(p.traction, u[:, 15])[:, None] * directions(u[:, 16])
    half_width = px * between(p.half_width, u[:, 17])
    half_width = half_width * np.where(tip, between(p.tip_size, u[:, 18]), 1.0)
    c, s = np.cos(rotation), np.sin(rotation)
    centre = middle + shift
    half_height = half_width * between(p.elongation, u[:, 19])
    x, y = (np.array(master_shape[::-1]) / 2 + towards).T
    tx, ty = centre[:, 0] - scale * (c * x - s * y), centre[:, 1] - scale * (s * x + c * y)
    rows = *centre.T, half_width, half_height, c, s, scale, tx, ty
    rows = *rows, np.cos(torsion), np.sin(torsion), *slide.T
    return Warps(*(row[:, None] for row in rows))


def directions(even: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit vectors (..., 2) at shares of a turn."""
    return np.stack([np.cos(2 * np.pi * even), np.sin(2 * np.pi * even)], axis=-1)
