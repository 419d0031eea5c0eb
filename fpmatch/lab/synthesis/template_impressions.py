"""Impressions of fingers without images: where they touch, and what an extractor finds there."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.synthesis import _impression_kernel as kernel
from fpmatch.lab.synthesis.contact import DRY_SPOT, WET_SPOT
from fpmatch.lab.synthesis.noise import keys_of, uniform
from fpmatch.lab.synthesis.template_fingers import STEP_PX, TURN, between, smooth_grids
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.contact import PressureParameters, SmearParameters
    from fpmatch.lab.synthesis.plan import Plan
    from fpmatch.lab.synthesis.sensor import Sensor
    from fpmatch.lab.synthesis.template_fingers import FingerBatch
    from fpmatch.lab.synthesis.warp import PlacementParameters

    Floats = NDArray[np.float32]

CELL_PX: Final = 16.0  # of a ridge field at 500 dpi
BORDER_PX: Final = 6.0  # without minutiae along the border of an image
MOST_FOUND: Final = 255  # minutiae of an impression
_PURPOSES: Final = range(131, 141)
_MOST_SPOTS: Final = 8
_SPOT_STRENGTH: Final = 0.8  # on average, of ragged spots
_OUTLINE_EXTENT_PX: Final = 60.0  # as `contact.press`
_FOR_KERNEL: Final = 12  # of the parameters, the first
_SMEAR_SHARES: Final = (0.0, 0.02, 0.05, 0.1, 0.15, 0.25, 0.5, 1.0)
_SMEAR_LIMITS: Final = (4.0, 2.05, 1.64, 1.28, 1.04, 0.67, 0.0, -4.0)  # of a normal number


@dataclass(frozen=True, slots=True)
class ExtractionParameters:
    """Set how extraction disturbs prints; doubt is 0 where ridges are clear, 1 where invisible.

    Chosen on the prints of all FVC databases at once.
    """

    missed: float = 0.02  # share of the minutiae where ridges are clear
    doubtful: float = 0.7  # doubt from which more are missed
    invisible: float = 0.6  # further doubt by which all are missed
    place_px: float = 1.2  # standard deviation along an axis, the more the more in doubt
    direction: float = 0.05  # and of the direction, radians
    kind: float = 0.12  # probability of the other kind
    spurious: float = 0.003  # probability of a spurious minutia in a clear cell
    spurious_in_doubt: float = 0.035  # and more of them at a doubt of 1
    quality: float = 85.0  # of a minutia on clear ridges
    quality_in_doubt: float = 35.0  # and less at a doubt of 1
    quality_range: float = 30.0  # evenly around that
    spurious_doubt: float = 0.25  # by which the quality of spurious ones is less

    most_doubt: float = 1.95  # of a cell of the print
    orientation_deg: float = 1.5  # standard deviation of an orientation
    phase: float = 0.02  # and of the phase of the ridges in a cell, in turns
    ridges: float = 0.53  # share of the ridges in a period


EXTRACTION: Final = ExtractionParameters()


def draw_impressions(
    plan: Plan,
    fingers: FingerBatch,
    numbers: NDArray[np.uint64],
    sensor: Sensor,
    extraction: ExtractionParameters = EXTRACTION,
) -> Iterator[Template]:
    """Yield the templates of the impressions `numbers`, from 1, of each finger in order."""
    preset = plan.ranges
    of = np.repeat(np.arange(len(fingers.finger), dtype=np.int32), len(numbers))
    number = np.tile(numbers, len(fingers.finger))
    keys = [keys_of(plan.seed, fingers.finger[of], number, purpose) for purpose in _PURPOSES]
    px = sensor.px
    cell = CELL_PX * px
    rows, columns = (int(np.ceil(side / cell)) for side in sensor.shape)
    shape = len(of), rows, columns
    warp = draw_warps(keys[0], plan.master.shape, sensor, preset.placement)
    corner = np.empty((len(of), rows + 1, columns + 1, 2))
    kernel.map_corners(warp, cell, corner)
    threshold, strength, outline = _pressure(keys[1:6], shape[1:], preset.pressure)
    threshold += _smears(keys[6], shape[1:], preset.smear)
    spots = _spots(keys[1], sensor, preset.pressure)
    doubt = np.empty(shape, np.float32)
    kernel.press(
        warp, corner, cell, outline, spots, fingers.edges, of, STEP_PX, threshold, strength, doubt
    )
    even = uniform(keys[7], rows * columns * 10).reshape(*shape, 10)
    swing = (even[..., 8:] - np.float32(0.5)) * np.float32(np.sqrt(12) * TURN)
    phase = (swing[..., 0] * np.float32(extraction.phase)).astype(np.int32)
    turned = (swing[..., 1] * np.float32(extraction.orientation_deg / 360)).astype(np.int32)
    mask, orientation = np.empty(shape, np.uint8), np.empty(shape, np.float32)
    ridges = np.empty(shape, np.uint64)
    width = round(extraction.ridges * TURN / 2)
    kernel.show_cells(
        corner, cell, doubt, extraction.most_doubt, width, of, STEP_PX, fingers.level,
        fingers.period, fingers.phase, fingers.inside, phase, turned, mask,
        orientation, ridges,
    )  # fmt: skip
    constants = np.array(astuple(extraction)[:_FOR_KERNEL])
    constants[3] *= px
    counts = np.empty(len(of), np.int32)
    minutiae = np.empty((len(of), MOST_FOUND, 5))
    most = int(fingers.count.max(initial=0))
    random = uniform(keys[8], most * 12).reshape(len(of), most, 12)
    size = float(sensor.width), float(sensor.height), BORDER_PX * px
    kernel.show_minutiae(
        warp, corner, cell, *size, doubt, of, fingers.minutiae, fingers.count, random, constants,
        fingers.bifurcation, minutiae, counts,
    )  # fmt: skip
    kernel.add_spurious(
        cell, *size, doubt, mask, orientation, np.ascontiguousarray(even[..., :8]), constants,
        minutiae, counts,
    )  # fmt: skip
    for k, count in enumerate(counts.tolist()):
        x, y, angle, kind, quality = minutiae[k, :count].T
        # pixels at 500 dpi, as extraction finds them
        x, y = ((np.rint((v + 0.5) / px - 0.5) + 0.5) * px - 0.5 for v in (x, y))
        field = RidgeField(cell, orientation[k], mask[k].astype(bool), ridges[k])
        yield Template(
            Minutiae(x, y, angle, kind, quality), sensor.width, sensor.height, sensor.dpi, field
        )


def draw_warps(
    keys: NDArray[np.uint64], master_shape: tuple[int, int], sensor: Sensor, p: PlacementParameters
) -> NDArray[np.float64]:
    """Draw where and how fingers touch, as `fpmatch.lab.synthesis.warp.draw_warp`; one row each.

    The columns are those of ``_impression_kernel.map_corners``.
    """
    u = uniform(keys, 22).astype(np.float64)
    px = sensor.px
    sign = np.where(u[:, :4] < 0.5, -1.0, 1.0)
    rotation = np.radians(between(p.rotation_deg, u[:, 4])) * sign[:, 0]
    scale = px * between(p.scale, u[:, 5])
    middle = np.array(sensor.shape[::-1]) / 2
    shift = px * between(p.shift, u[:, 6:8]) * sign[:, 1:3]
    tip, cut = u[:, 8] < p.tip_only, u[:, 9] < p.cut_off
    off = np.where(tip, between(p.tip_off_centre, u[:, 10]), between(p.off_centre, u[:, 10]))
    towards = off[:, None] * _directions(u[:, 11])
    beyond = between(p.cut_shift, u[:, 12])[:, None] * 2 * middle * _directions(u[:, 13])
    shift = np.where(cut[:, None], beyond, shift)
    torsion = np.radians(between(p.torsion_deg, u[:, 14])) * sign[:, 3]
    slide = px * between(p.traction, u[:, 15])[:, None] * _directions(u[:, 16])
    half_width = px * between(p.half_width, u[:, 17])
    half_width = half_width * np.where(tip, between(p.tip_size, u[:, 18]), 1.0)
    c, s = np.cos(rotation), np.sin(rotation)
    centre = middle + shift
    warp = np.empty((len(u), 13))
    warp[:, :2], warp[:, 2] = centre, half_width
    warp[:, 3] = half_width * between(p.elongation, u[:, 19])
    warp[:, 4], warp[:, 5], warp[:, 6] = c, s, scale
    x, y = (np.array(master_shape[::-1]) / 2 + towards).T
    warp[:, 7], warp[:, 8] = (
        centre[:, 0] - scale * (c * x - s * y),
        centre[:, 1] - scale * (s * x + c * y),
    )
    warp[:, 9], warp[:, 10], warp[:, 11:] = np.cos(torsion), np.sin(torsion), slide
    return warp


def _pressure(
    keys: list[NDArray[np.uint64]], shape: tuple[int, int], p: PressureParameters
) -> tuple[Floats, Floats, Floats]:
    """Draw threshold, strength and relative outline in each cell, as `contact.press`."""
    u = uniform(keys[0], 4).astype(np.float64)
    column = (slice(None), None, None)
    rows, columns = np.linspace(-1, 1, shape[0])[:, None], np.linspace(-1, 1, shape[1])
    x, y = (part[column] for part in _directions(u[:, 1]).T)
    threshold = p.unevenness * smooth_grids(keys[1], shape, p.unevenness_extent_px / CELL_PX)
    threshold += between(p.dryness, u[:, 0])[column]
    threshold += between(p.tilt, u[:, 2])[column] * (x * columns + y * rows)
    worn = 1 + np.tanh(smooth_grids(keys[2], shape, p.wear_extent_px / CELL_PX))
    strength = 1 - between(p.wear, u[:, 3])[column] * worn / 2
    outline = 1 + p.outline * smooth_grids(keys[3], shape, _OUTLINE_EXTENT_PX / CELL_PX)
    outline += (
        p.ragged
        * np.float32(np.sqrt(12))
        * (uniform(keys[4], shape[0] * shape[1]).reshape(-1, *shape) - np.float32(0.5))
    )
    return threshold.astype(np.float32), strength.astype(np.float32), outline.astype(np.float32)


def _smears(keys: NDArray[np.uint64], shape: tuple[int, int], p: SmearParameters) -> Floats:
    """Draw patches of smeared ridges: what they add to the threshold in each cell."""
    u = uniform(keys, 2)
    limit = np.interp(between(p.share, u[:, 1]), _SMEAR_SHARES, _SMEAR_LIMITS)
    limit = np.where(u[:, 0] < p.chance, limit, np.inf)
    patches = smooth_grids(keys, shape, p.extent_px / CELL_PX, skip=2)
    return np.asarray(np.clip(2.5 * (patches - limit[:, None, None]), 0, 1), np.float32)


def _spots(keys: NDArray[np.uint64], sensor: Sensor, p: PressureParameters) -> NDArray[np.float64]:
    """Draw spots too wet or too dry: x, y, inverse extents in pixels, and height, (B, 8, 5)."""
    most = min(p.max_spots, _MOST_SPOTS)
    u = uniform(keys, 8 + _MOST_SPOTS * 5)[:, 8:].reshape(-1, _MOST_SPOTS, 5).astype(np.float64)
    count = uniform(keys, 5)[:, 4] * (most + 1)
    extent = between(p.spot_radius_px, u[..., 2]) * sensor.px
    stretch = between((0.6, 1.6), u[..., 3])
    spots = np.empty((len(keys), _MOST_SPOTS, 5))
    spots[..., 0] = between((0.1, 0.9), u[..., 0]) * sensor.width
    spots[..., 1] = between((0.1, 0.9), u[..., 1]) * sensor.height
    spots[..., 2], spots[..., 3] = stretch / extent, 1 / (stretch * extent)
    spots[..., 4] = _SPOT_STRENGTH * np.where(u[..., 4] < 0.5, WET_SPOT, DRY_SPOT)
    spots[np.arange(_MOST_SPOTS) >= np.floor(count)[:, None], 4] = 0
    return spots


def _directions(even: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([np.cos(2 * np.pi * even), np.sin(2 * np.pi * even)], axis=-1)
