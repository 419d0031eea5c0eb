"""Where and how the fingers of many impressions touch the sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.lab.synthesis.warp import STICKING_RADIUS
from research.templates.numbers import between, uniform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.sensor import Sensor
    from fpmatch.lab.synthesis.warp import PlacementParameters
    from research.templates.numbers import Doubles

    Plane = NDArray[np.complex128]  # x + iy, y down

_ROUNDS: Final = 8  # of the inverse of a warp


class Warps(NamedTuple):
    """Where and how fingers touch: maps as `fpmatch.lab.synthesis.warp.Warp`, (B, 1) each."""

    centre: Plane
    half_width: Doubles
    half_height: Doubles
    turn: Plane  # of length 1
    scale: Doubles
    shift: Plane
    twist: Plane  # of length 1
    slide: Plane

    def upright(self, at: Plane) -> tuple[Doubles, Doubles]:
        """Return places across and along the finger, in half axes."""
        away = (at - self.centre) * self.turn.conj()
        return away.real / self.half_width, away.imag / self.half_height

    def drag(self, at: Plane) -> Plane:
        """Return the drag of the skin at places."""
        x, y = self.upright(at)
        slip = np.clip(np.sqrt(x * x + y * y) - STICKING_RADIUS, 0, 1)
        t = slip * slip * (np.pi / 2) ** 2
        s = np.pi / 2 * slip * (1 - t / 6 * (1 - t / 20 * (1 - t / 42 * (1 - t / 72))))
        share = np.where(slip >= 1, 1.0, s * s)
        away = at - self.centre
        return np.asarray(share * (self.twist * away - away + self.slide))

    def to_master(self, at: Plane) -> Plane:
        """Map places of the images to the masters."""
        return np.asarray((at - self.drag(at) - self.shift) * self.turn.conj() / self.scale)

    def from_master(self, at: Plane) -> Plane:
        """Map places of the masters to the images."""
        goal = reached = np.asarray(self.scale * self.turn * at + self.shift)
        for _ in range(_ROUNDS):
            reached = goal + self.drag(reached)
        return reached


def draw_warps(
    keys: NDArray[np.uint64], master_shape: tuple[int, int], sensor: Sensor, p: PlacementParameters
) -> Warps:
    """Draw where and how fingers touch, as `fpmatch.lab.synthesis.warp.draw_warp`."""
    u, px = uniform(keys, 20).astype(np.float64).T, sensor.px
    sign = np.where(u[:4] < 0.5, -1.0, 1.0)
    cut_side, towards_side, slide_side = np.exp(2j * np.pi * u[[13, 11, 16]])
    turn = np.exp(1j * np.radians(between(p.rotation_deg, u[4])) * sign[0])
    scale = px * between(p.scale, u[5])
    x, y = px * between(p.shift, u[6:8]) * sign[1:3]
    tip, cut = u[8] < p.tip_only, u[9] < p.cut_off
    off = np.where(tip, between(p.tip_off_centre, u[10]), between(p.off_centre, u[10]))
    beyond = between(p.cut_shift, u[12])
    x = np.where(cut, beyond * sensor.width * cut_side.real, x)
    y = np.where(cut, beyond * sensor.height * cut_side.imag, y)
    centre = complex(sensor.width, sensor.height) / 2 + x + 1j * y
    touching = complex(*master_shape[::-1]) / 2 + off * towards_side
    twist = np.exp(1j * np.radians(between(p.torsion_deg, u[14])) * sign[3])
    half_width = px * between(p.half_width, u[17])
    half_width = half_width * np.where(tip, between(p.tip_size, u[18]), 1.0)
    half_height = half_width * between(p.elongation, u[19])
    slide = px * between(p.traction, u[15]) * slide_side
    placed = turn, scale, centre - scale * turn * touching
    rows = (centre, half_width, half_height, *placed, twist, slide)
    columns: Any = (row[:, None] for row in rows)
    return Warps(*columns)
