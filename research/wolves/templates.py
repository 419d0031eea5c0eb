"""Templates of random minutiae and drawn ridges, in pixels at 500 dpi.

The same generator of random numbers gives the same templates.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.templates.minutiae import Minutiae, Template
from fpmatch.templates.ridge_field import RidgeField

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

FRAME_PX: Final = 400  # side of the frame of what is made here
CELL_PX: Final = 16.0
BITS: Final = 8  # of a side of a cell's picture of its ridges
FIELD_MARGIN_PX: Final = 16.0  # of the ridges around the minutiae of a fragment
LEAST_QUALITY: Final = 1.0  # of minutiae that hardly count when unpaired


@dataclass(frozen=True)
class Wave:
    """Describe ridges that are drawn: parallel stripes where the bend is 0, else arches.

    `orientation`, `phase`: in radians. `period`: distance of the ridges. `bend`: by how much the
    ridges fall off at 100 px from the middle, as a share of those 100 px.
    """

    orientation: float
    period: float
    phase: float = 0.0
    bend: float = 0.0

    @classmethod
    def random(cls, rng: np.random.Generator, periods: tuple[float, float] = (3.0, 24.0)) -> Wave:
        """Return ridges of any orientation and of a period within the limits."""
        bend = rng.uniform(-1.0, 1.0) if rng.random() < 0.5 else 0.0
        return cls(
            rng.uniform(0, np.pi),
            float(np.exp(rng.uniform(*np.log(periods)))),
            rng.uniform(0, 2 * np.pi),
            float(bend),
        )

    def at(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the phase at places relative to the middle, y pointing down."""
        c, s = np.cos(self.orientation), -np.sin(self.orientation)
        along, across = c * x + s * y, c * y - s * x
        turns = (across + self.bend * along**2 / 100.0) / self.period
        return np.asarray(2 * np.pi * turns + self.phase)


def drawn_field(
    wave: Wave, inside: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.bool_]]
) -> RidgeField:
    """Return a ridge field of drawn ridges, on the cells whose middle `inside` accepts."""
    count = round(FRAME_PX / CELL_PX)
    y, x = (np.mgrid[:count, :count] + 0.5) * CELL_PX
    half = FRAME_PX / 2
    ahead = wave.at(x + 0.5 - half, y - half) - wave.at(x - 0.5 - half, y - half)
    below = wave.at(x - half, y + 0.5 - half) - wave.at(x - half, y - 0.5 - half)
    orientation = np.mod(np.arctan2(ahead, below), np.pi)  # across the gradient; y points down
    fine_y, fine_x = (np.mgrid[: count * BITS, : count * BITS] + 0.5) * (CELL_PX / BITS) - half
    dark = np.cos(wave.at(fine_x, fine_y)) > 0
    bits = dark.reshape(count, BITS, count, BITS).transpose(0, 2, 1, 3).reshape(count, count, -1)
    ridges = np.packbits(bits, axis=2, bitorder="little").view("<u8")[..., 0]
    return RidgeField(CELL_PX, orientation.astype(np.float32), inside(x, y), ridges)


def around_minutiae(
    minutiae: Minutiae, margin_px: float = FIELD_MARGIN_PX
) -> Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.bool_]]:
    """Return the indicator function of the disc around the minutiae, with a margin."""
    xy = minutiae.xy.astype(np.float64)
    middle = (xy.min(axis=0) + xy.max(axis=0)) / 2 if len(xy) else np.zeros(2)
    radius = np.hypot(*(xy - middle).T).max(initial=0.0) + margin_px
    return lambda x, y: np.hypot(x - middle[0], y - middle[1]) <= radius


def with_ridges(template: Template, wave: Wave, margin_px: float = FIELD_MARGIN_PX) -> Template:
    """Return a template with drawn ridges in the disc around its minutiae."""
    return replace(template, field=drawn_field(wave, around_minutiae(template.minutiae, margin_px)))


def of_points(
    xy: NDArray[np.float64], angle: NDArray[np.float64], quality: float = 100.0
) -> Template:
    """Return a template of minutiae about the middle of the frame, those outside moved to it."""
    x, y = np.clip(xy.T + FRAME_PX / 2, 0.0, FRAME_PX - 1.0)
    minutiae = Minutiae(x, y, angle, quality=np.full(len(x), quality))  # type: ignore[arg-type]
    return Template(minutiae, FRAME_PX, FRAME_PX)


def compact(size: int, rng: np.random.Generator) -> Template:
    """Return few minutiae in random places of a small square, in random or near directions."""
    side = rng.uniform(10.0, 30.0) * np.sqrt(size)
    xy = rng.uniform(-side / 2, side / 2, (size, 2))
    spread = rng.choice([np.pi, 0.4])
    angle = rng.uniform(0, 2 * np.pi) + rng.uniform(-spread, spread, size)
    return of_points(xy, angle, _quality(rng))


def grid(size: int, rng: np.random.Generator) -> Template:
    """Return minutiae on a square grid, jittered, in random or equal or bending directions."""
    columns = int(np.ceil(np.sqrt(size)))
    places = np.stack(np.divmod(np.arange(size), columns), axis=1)[:, ::-1] - (columns - 1) / 2
    xy = places * rng.uniform(6.0, 24.0) + rng.normal(0, rng.choice([0.0, 3.0]), (size, 2))
    return of_points(xy, _directions(xy, rng), _quality(rng))


def cluster(size: int, rng: np.random.Generator) -> Template:
    """Return minutiae of which many lie in one place, or within a few pixels of it."""
    places = int(rng.integers(3, 13))
    middles = rng.uniform(-1, 1, (places, 2)) * rng.uniform(20, 150)
    spread = rng.choice([0.0, 1.0, 4.0])
    xy = middles[np.arange(size) % places] + rng.normal(0, spread, (size, 2))
    turns = np.asarray(np.arange(size) // places * (2 * np.pi * places / size), np.float64)
    return of_points(xy, turns if rng.random() < 0.5 else _directions(xy, rng), _quality(rng))


def fan(size: int, rng: np.random.Generator) -> Template:
    """Return minutiae along parallel lines or rays, directed along them, forth or back."""
    lines = int(rng.integers(3, 16))
    line, place = np.arange(size) % lines, np.arange(size) // lines
    gap = rng.uniform(6.0, 24.0)
    along = (place - (size / lines) / 2) * gap
    spread = rng.choice([0.0, np.pi / 4, np.pi])
    turn = spread * (line / lines - 0.5) + rng.uniform(0, 2 * np.pi)
    aside = (line - lines / 2) * rng.uniform(6.0, 24.0) * (spread == 0)
    xy = np.column_stack(
        [along * np.cos(turn) - aside * np.sin(turn), along * np.sin(turn) + aside * np.cos(turn)]
    )
    back = np.pi * (rng.random(size) < rng.choice([0.0, 0.5]))
    return of_points(xy, -turn + back, _quality(rng))


FEW: Final = {"random minutiae": compact}
MANY: Final = {"grid": grid, "clusters": cluster, "fan": fan}


def _directions(xy: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return random directions, equal ones, or those along arches, forth or back."""
    kind, turn = rng.integers(3), rng.uniform(0, 2 * np.pi)
    if kind == 0:
        return rng.uniform(0, 2 * np.pi, len(xy))
    if kind == 1:
        return np.full(len(xy), turn)
    back = np.pi * (rng.random(len(xy)) < 0.5)
    return np.asarray(np.arctan(-xy[:, 0] / 100.0) + back)


def _quality(rng: np.random.Generator) -> float:
    """Return the quality of all minutiae: none given, or the least."""
    return float(rng.choice([100.0, LEAST_QUALITY]))
