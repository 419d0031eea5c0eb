"""Impressions of fingers without images: where they touch, and what an extractor finds there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.lab.synthesis.contact import (
    DRY_SPOT,
    EDGE_START,
    EDGE_STEEPNESS,
    FOOT_EXPONENT,
    TIP_EXPONENT,
    WET_SPOT,
)
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from research.templates.numbers import (
    HALF,
    MASK,
    QUARTER,
    RADIANS,
    SQRT_12,
    TURN,
    angle_of,
    between,
    cosine,
    keys_of,
    smooth_grids,
    uniform,
)
from research.templates.ridges import STEP_PX
from research.templates.warps import draw_warps

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.database import Plan
    from fpmatch.lab.synthesis.presets import Preset
    from fpmatch.lab.synthesis.sensor import Sensor
    from research.templates.fingers import FingerBatch
    from research.templates.numbers import Doubles, Floats, Ints
    from research.templates.warps import Plane, Warps

CELL_PX: Final = 16.0  # of a ridge field at 500 dpi
BORDER_PX: Final = 6.0  # without minutiae along the border of an image
MOST_FOUND: Final = 255  # minutiae of an impression
_PURPOSES: Final = range(131, 141)
_MOST_SPOTS: Final = 8
_SPOT_STRENGTH: Final = 0.8  # on average, of ragged spots
_OUTLINE_EXTENT_PX: Final = 60.0  # as `contact.press`
_SIDE: Final = 8  # bits along a cell
_BROKEN: Final = 0.6  # share of spurious minutiae that come in pairs
_GAP: Final = (0.4, 1.0)  # between them, in cells
_OUTLINE_STEPS: Final = 64  # of the tables of the outline
_RATIOS: Final = np.arange(_OUTLINE_STEPS + 2) / _OUTLINE_STEPS
_AT_TIP, _AT_JOINT = ((1 + _RATIOS**p) ** (1 / p) for p in (TIP_EXPONENT, FOOT_EXPONENT))
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


def draw_impressions(
    plan: Plan,
    fingers: FingerBatch,
    numbers: NDArray[np.uint64],
    sensor: Sensor,
    extraction: ExtractionParameters | None = None,
) -> Iterator[Template]:
    """Yield the templates of the impressions `numbers`, from 1, of each finger in order."""
    p, preset, px = extraction or ExtractionParameters(), plan.preset, sensor.px
    of = np.repeat(np.arange(len(fingers.finger)), len(numbers))
    number = np.tile(numbers, len(fingers.finger))
    keys = [keys_of(plan.seed, fingers.finger[of], number, purpose) for purpose in _PURPOSES]
    cell = CELL_PX * px
    shape = (int(np.ceil(sensor.height / cell)), int(np.ceil(sensor.width / cell)))
    warp = draw_warps(keys[0], plan.master.shape, sensor, preset.placement)
    y, x = np.mgrid[: shape[0] + 1, : shape[1] + 1].reshape(2, -1) * cell
    corner = warp.to_master((x + 1j * y)[None]).reshape(-1, shape[0] + 1, shape[1] + 1)
    cells = Cells(fingers, of, corner, cell)
    pressed = _pressure(keys[1:7], shape, preset)
    doubt = _doubt(cells, warp, pressed, _spots(keys[1], sensor, preset))
    even = uniform(keys[7], shape[0] * shape[1] * 10).reshape(-1, *shape, 10)
    swing = (even[..., 8:] - np.float32(0.5)) * np.float32(np.sqrt(12) * TURN)
    phase = (swing[..., 0] * np.float32(p.phase)).astype(np.int64)
    turned = (swing[..., 1] * np.float32(p.orientation_deg / 360)).astype(np.int64)
    mask, orientation = cells.orientation(turned)
    mask &= doubt <= p.most_doubt
    orientation = np.where(mask, orientation, np.float32(0))
    ridges = np.where(mask, cells.ridges(phase, round(p.ridges * TURN / 2)), np.uint64(0))
    real = _real_minutiae(cells, warp, doubt, keys[8], p, px)
    made = np.vstack([real, _spurious_minutiae(cells, doubt, mask, orientation, even, p)])
    x, y = made[:, 1:3].T - BORDER_PX * px
    width, height = (side - 2 * BORDER_PX * px for side in (sensor.width, sensor.height))
    made = made[(x >= 0) & (x < width) & (y >= 0) & (y < height)]
    made = made[np.argsort(made[:, 0], kind="stable")]
    ends = np.searchsorted(made[:, 0], np.arange(len(of) + 1))
    for k, (begin, end) in enumerate(pairwise(ends)):
        x, y, *beside = made[begin:end][:MOST_FOUND, 1:].T
        # pixels at 500 dpi, as extraction finds them
        x, y = ((np.rint((v + 0.5) / px - 0.5) + 0.5) * px - 0.5 for v in (x, y))
        field = RidgeField(cell, orientation[k], mask[k], ridges[k])
        yield Template(Minutiae(x, y, *beside), sensor.width, sensor.height, sensor.dpi, field)


class Cells(NamedTuple):
    """The cells of a ridge field, (B, R, C), of a batch of impressions of fingers."""

    fingers: FingerBatch
    of: NDArray[np.intp]  # the finger of each impression, (B,)
    corner: Plane  # places in the master of the corners of cells, (B, R + 1, C + 1)
    cell: float  # side of a cell in pixels of the image

    @property
    def sides(self) -> tuple[Plane, Plane]:
        """The mean of the upper and the lower side of each cell, and of the left and right one."""
        across, down = np.diff(self.corner, axis=2), np.diff(self.corner, axis=1)
        return (
            0.5 * across[:, :-1] + 0.5 * across[:, 1:],
            0.5 * down[..., :-1] + 0.5 * down[..., 1:],
        )

    def nodes(self, at: Plane) -> tuple[tuple[Ints, Ints, Ints], NDArray[np.bool_]]:
        """Return finger, row and column of the nodes nearest to places, and which there are."""
        i, j = (np.floor(v / STEP_PX + 0.5).astype(np.int64) for v in (at.imag, at.real))
        rows, columns = self.fingers.level.shape[1:]
        there = (i >= 0) & (i < rows) & (j >= 0) & (j < columns)
        node = np.broadcast_to(self.of[:, None, None], i.shape), i * there, j * there
        return node, there & self.fingers.inside[node]

    def orientation(self, turned: Ints) -> tuple[NDArray[np.bool_], Floats]:
        """Return where skin is, and the orientation there in radians, `turned` by so much."""
        a, b = self.sides
        node, there = self.nodes(self.corner[:, :-1, :-1] + 0.5 * (a + b))
        angle = _to_image(self.fingers.level[node], a, b) + turned
        return there, ((angle & (HALF - 1)) * RADIANS).astype(np.float32)

    def ridges(self, noise: Ints, width: int) -> NDArray[np.uint64]:
        """Return 8 by 8 bits of each cell: ridges, where the phase is less than `width`."""
        a, b = (side / _SIDE for side in self.sides)
        bits = np.zeros((*noise.shape, _SIDE, _SIDE), bool)
        for row, column in ((0, 0), (0, 4), (4, 0), (4, 4)):
            middle = self.corner[:, :-1, :-1] + (column + 2) * a + (row + 2) * b
            node, there = self.nodes(middle)
            angle = self.fingers.level[node]
            per_px = (np.float32(TURN) / self.fingers.period[node]).astype(np.float64)
            along = (1j * cosine(angle) - cosine(angle - QUARTER)) * per_px
            off = middle - 1.5 * (a + b) - (node[2] + 1j * node[1]) * STEP_PX
            part, across, down = ((along * v).real.astype(np.int32) for v in (off, a, b))
            here = (self.fingers.phase[node] + noise + part + (width - 1)).astype(np.int32)
            for r, c in np.ndindex(4, 4):
                hit = ((here + c * across + r * down) & MASK) < 2 * width - 1
                bits[..., row + r, column + c] = hit & there
        packed = np.packbits(bits, axis=-1, bitorder="little")
        return packed.reshape(*noise.shape, -1).view("<u8")[..., 0].astype(np.uint64)


def _to_image(angle: Ints, a: Plane, b: Plane) -> Ints:
    """Return directions of the master in the image, whose x and y axes map to a and b."""
    ahead = cosine(angle) + 1j * cosine(angle - QUARTER)
    return angle_of((a * ahead).imag, (b * ahead).imag)


def _doubt(cells: Cells, warp: Warps, pressed: tuple[Floats, ...], spots: Doubles) -> Floats:
    """Return how doubtful ridges are in each cell (B, R, C), 2 where no skin touches."""
    threshold, strength, outline = pressed
    middle = 0.5 * (cells.corner[:, :-1, :-1] + cells.corner[:, 1:, 1:])
    row = np.floor(middle.imag / STEP_PX + 0.5).astype(np.int64)
    edges = cells.fingers.edges
    there = (row >= 0) & (row < edges.shape[1])
    left, right = np.moveaxis(edges[cells.of[:, None, None], row * there], -1, 0)
    there &= (middle.real >= left) & (middle.real <= right)
    rows, columns = threshold.shape[1:]
    y, x = (np.mgrid[:rows, :columns] + 0.5) * cells.cell
    ux, uy = warp.upright((x + 1j * y).reshape(1, -1))
    larger, smaller = np.maximum(abs(ux), abs(uy)), np.minimum(abs(ux), abs(uy))
    at = _OUTLINE_STEPS * smaller / np.where(larger > 0, larger, 1)
    step = at.astype(np.intp)
    tip, joint = (
        table[step] * (1 - (at - step)) + table[step + 1] * (at - step)
        for table in (_AT_TIP, _AT_JOINT)
    )
    radius = (larger * np.where(uy > 0, joint, tip)).reshape(threshold.shape)
    out = np.maximum(radius * outline - EDGE_START, 0)
    height = (threshold + EDGE_STEEPNESS * out * out).astype(np.float32)
    for spot in spots[:, :, None, None].transpose(1, 4, 0, 2, 3):
        dx, dy = (x - spot[0]) * spot[2], (y - spot[1]) * spot[3]
        height = (height + spot[4] * np.exp(-0.5 * (dx * dx + dy * dy))).astype(np.float32)
    return np.where(there, np.minimum(np.abs(height) / strength, np.float32(2)), np.float32(2))


def _real_minutiae(
    cells: Cells, warp: Warps, doubt: Floats, key: Any, p: ExtractionParameters, px: float
) -> Doubles:
    """Return impression, x, y, direction, kind and quality of minutiae that the finger has."""
    count = np.array([len(one) for one in cells.fingers.minutiae])
    most = int(count.max(initial=0))
    random = uniform(key, most * 12).reshape(len(key), most, 12)
    listed = np.zeros((len(count), most, 3))
    listed[np.arange(most) < count[:, None]] = np.concatenate(cells.fingers.minutiae)
    at = warp.from_master((listed[..., 0] + 1j * listed[..., 1])[cells.of])
    i, j = (np.floor(v / cells.cell).astype(np.int64) for v in (at.imag, at.real))
    there = (i >= 0) & (j >= 0) & (i < doubt.shape[1]) & (j < doubt.shape[2])
    b, k = np.nonzero(there & (np.arange(most) < count[cells.of, None]))
    unsure = doubt[b, i[b, k], j[b, k]].astype(np.float64)
    missed = p.missed + (1 - p.missed) * (unsure - p.doubtful) / p.invisible
    seen = (random[b, k, 0] >= np.maximum(missed, p.missed)) & (unsure < 2)
    b, k, unsure = b[seen], k[seen], unsure[seen]
    r, i, j = random[b, k].T, i[b, k], j[b, k]
    dx, dy, turned = (
        2 * (r[[one, two, three]].sum(axis=0).astype(np.float64) - 1.5)
        for one, two, three in ((1, 2, 3), (4, 5, 6), (1, 4, 7))
    )
    at = at[b, k] + p.place_px * px * (1 + unsure) * _tail(r[10]) * (dx + 1j * dy)
    start = cells.corner[b, i, j]
    a, down = cells.corner[b, i, j + 1] - start, cells.corner[b, i + 1, j] - start
    angle = _to_image(listed[cells.of[b], k, 2].astype(np.int64), a, down) * RADIANS
    angle += p.direction * (1 + unsure) * _tail(r[11]) * turned
    flipped = r[8] < p.kind * (1 + unsure)
    kind = np.where(cells.fingers.bifurcation[cells.of[b], k] != flipped, 2, 1)
    return np.column_stack([b, at.real, at.imag, angle, kind, _quality(unsure, r[9], p)])


def _spurious_minutiae(
    cells: Cells, doubt: Floats, mask: Any, turn: Floats, even: Floats, p: ExtractionParameters
) -> Doubles:
    """Return the same of minutiae that the finger lacks: single ones, or at a broken ridge."""
    unsure = doubt.astype(np.float64)
    likely = p.spurious + p.spurious_in_doubt * unsure * unsure
    b, i, j = np.nonzero(mask & (even[..., 0] < likely))
    r, unsure = even[b, i, j].T, unsure[b, i, j]
    x, y = ((v.astype(np.float32) + r[k]) * cells.cell for k, v in ((1, j), (2, i)))
    along = turn[b, i, j] + np.where(r[3] < 0.5, np.pi, 0)
    gap = np.where(r[6] < _BROKEN, between(_GAP, r[4].astype(np.float64)) * cells.cell, 0)
    kind, quality = np.where(r[7] < 0.5, 1, 2), _quality(unsure + p.spurious_doubt, r[5], p)
    ends = []
    for end in range(2):
        angle = along + p.direction * (1 + unsure) * 3.4 * (r[4 + end].astype(np.float64) - 0.5)
        place = x - end * gap * np.cos(along), y + end * gap * np.sin(along)
        ends.append(np.column_stack([b, *place, angle + np.pi * end, kind, quality]))
    both = np.stack(ends, axis=1).reshape(-1, 6)
    return np.asarray(both[np.column_stack([np.ones(len(b), bool), gap > 0]).ravel()])


def _tail(even: Floats) -> Doubles:
    """Return a factor of mean square 1 that gives normal numbers long tails."""
    r = even.astype(np.float64)
    return np.asarray(0.5 + 2.0 * r * r * r * r * r)


def _quality(unsure: Doubles, even: Floats, p: ExtractionParameters) -> Doubles:
    """Return the quality of minutiae, 0 to 100."""
    quality = p.quality - p.quality_in_doubt * unsure
    quality = quality + p.quality_range * (even.astype(np.float64) - 0.5)
    return np.asarray(np.floor(np.clip(quality, 1.0, 100.0)))


def _pressure(
    keys: list[NDArray[np.uint64]], shape: tuple[int, int], preset: Preset
) -> tuple[Floats, ...]:
    """Draw threshold, strength and relative outline in each cell, as `contact.press`."""
    p = preset.pressure
    u = uniform(keys[0], 4).astype(np.float64)
    column = (slice(None), None, None)
    rows, columns = np.linspace(-1, 1, shape[0])[:, None], np.linspace(-1, 1, shape[1])
    side = np.exp(2j * np.pi * u[:, 1])[column]
    threshold = p.unevenness * smooth_grids(keys[1], shape, p.unevenness_extent_px / CELL_PX)
    threshold += between(p.dryness, u[:, 0])[column]
    threshold += between(p.tilt, u[:, 2])[column] * (side.real * columns + side.imag * rows)
    worn = 1 + np.tanh(smooth_grids(keys[2], shape, p.wear_extent_px / CELL_PX))
    strength = 1 - between(p.wear, u[:, 3])[column] * worn / 2
    outline = 1 + p.outline * smooth_grids(keys[3], shape, _OUTLINE_EXTENT_PX / CELL_PX)
    outline += (
        p.ragged
        * SQRT_12
        * (uniform(keys[4], shape[0] * shape[1]).reshape(-1, *shape) - np.float32(0.5))
    )
    smeared = uniform(keys[5], 2)
    limit = np.interp(between(preset.smear.share, smeared[:, 1]), _SMEAR_SHARES, _SMEAR_LIMITS)
    limit = np.where(smeared[:, 0] < preset.smear.chance, limit, np.inf)
    patches = smooth_grids(keys[5], shape, preset.smear.extent_px / CELL_PX, skip=2)
    threshold = threshold.astype(np.float32)
    threshold += np.clip(2.5 * (patches - limit[column]), 0, 1).astype(np.float32)
    return threshold, strength.astype(np.float32), outline.astype(np.float32)


def _spots(keys: NDArray[np.uint64], sensor: Sensor, preset: Preset) -> Doubles:
    """Draw spots too wet or too dry: x, y, inverse extents in pixels, and height, (B, 8, 5)."""
    p = preset.pressure
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
