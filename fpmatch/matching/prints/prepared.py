"""Prepared templates: what a matcher computes once for all comparisons of a template.

The area of a print is the cells inside its mask, or inside the convex hull of its minutiae.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.matching import constants as fixed
from fpmatch.templates.minutiae import STANDARD_DPI
from fpmatch.templates.plausibility import ENOUGH_ON_RIDGES, are_uneven, lie_off_ridges

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.matching.parameters import MatchParameters
    from fpmatch.templates.minutiae import RidgeField, Template

_FRAME: Final = struct.Struct("=qqqqqd")  # of a region, in its content


@dataclass(frozen=True, slots=True, eq=False)
class PrintArea:
    """The area of a print as square cells, and their ridge orientation.

    A code is 0 outside the print; inside, 1 to `ORIENTATIONS` for the ridge orientation, or 1 alone
    where it is not known.
    """

    step: float  # side of a cell
    code: NDArray[np.uint8]  # (rows, columns)
    first_row: int  # of these cells among all, from the image's top left corner
    first_column: int
    has_flow: bool  # whether the orientation is known at all
    ridges: NDArray[np.uint64] | None = None  # binary images as in `RidgeField`, where known

    @property
    def inside(self) -> int:
        """Number of cells inside the print."""
        return int(np.count_nonzero(self.code))

    @property
    def area(self) -> float:
        """Area of the print."""
        return self.inside * (self.step * self.step)


def orientation_codes(
    orientation: NDArray[np.floating], mask: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Return the codes of orientations in radians: 1 to `ORIENTATIONS`, and 0 outside the mask."""
    code = np.zeros(mask.shape, np.uint8)
    step = np.rint(orientation[mask].astype(np.float64) * (fixed.ORIENTATIONS / np.pi))
    code[mask] = step.astype(np.int64) % fixed.ORIENTATIONS + 1
    return code


def codes_at(region: PrintArea, z: NDArray[np.complex128]) -> NDArray[np.uint8]:
    """Return the codes of a print area at places x + iy, y pointing up: 0 outside."""
    per_px = 1.0 / region.step
    x, y = z.real * per_px - region.first_column, -z.imag * per_px - region.first_row
    rows, columns = region.code.shape
    codes = np.zeros(z.shape, np.uint8)
    within = (x >= 0.0) & (x < columns) & (y >= 0.0) & (y < rows)
    codes[within] = region.code[y[within].astype(np.intp), x[within].astype(np.intp)]
    return codes


def area_of_field(field: RidgeField, to_500dpi: float) -> PrintArea:
    """Return the mask of a ridge field with its orientation and ridges, at 500 dpi."""
    box, at = _box(field.mask)
    code = orientation_codes(field.orientation[box], field.mask[box])
    ridges = None if field.ridges is None else np.ascontiguousarray(field.ridges[box])
    return PrintArea(field.step * to_500dpi, code, *at, has_flow=True, ridges=ridges)


def area_of_hull(points: NDArray[np.float64], step_px: float, max_cells: int) -> PrintArea:
    """Return the convex hull of minutiae (4, N) as an area of unknown orientation.

    Its cells have a side of `step_px`, or larger ones where more than `max_cells` would lie along a
    side of the area.
    """
    inside = (points[0] >= 0) & (points[1] <= 0)
    x, y = points[0, inside], -points[1, inside]
    reach = max(x.max(initial=0.0), y.max(initial=0.0))
    step = max(step_px, reach / max_cells)
    corners = np.floor(np.column_stack([x, y]) / step).astype(np.int32)
    size = (corners.max(axis=0) + 1) if len(corners) else np.array([1, 1])
    mask = np.zeros((int(size[1]), int(size[0])), np.uint8)
    if len(corners):
        cv2.fillConvexPoly(mask, cv2.convexHull(corners), 1)
    box, at = _box(mask)
    return PrintArea(step, np.ascontiguousarray(mask[box]), *at, has_flow=False)


def _box(mask: NDArray[Any]) -> tuple[tuple[slice, slice], tuple[int, int]]:
    """Return the part of a mask without empty rows and columns around it, and where it begins."""
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8)) if mask.size else (0, 0, 0, 0)
    return (slice(top, top + height), slice(left, left + width)), (top, left)


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhoods:
    """The neighbourhoods of N minutiae as flat arrays.

    In the frame of a minutia its direction is +u. A neighbour has its position u, v, its direction
    c, s, 1/tolerance² and its weight.
    """

    count: NDArray[np.int32]  # (N,): neighbours kept of each minutia
    frame: NDArray[np.float32]  # (N, 6, size): the neighbours in the frame of the minutia


@dataclass(frozen=True, slots=True, eq=False)
class BitDescriptors:
    """The bit descriptors of a print of N minutiae.

    Each minutia has a word for each of its neighbours: the cell of position and direction, in the
    minutia's own frame, in which the neighbour lies in each of two grids; see `matching.constants`.
    Twelve more words are the bins of the ridge orientation at places around it.
    """

    xy: NDArray[np.float32]  # (N, 2): px at 500 dpi, y pointing up
    direction_bin: NDArray[np.uint8]  # (N,), in 256ths of a turn
    neighbour_bits: NDArray[np.uint16]  # (N, 12); 0x8800 where there is no neighbour
    orientation_bins: NDArray[np.uint8]  # (N, 12): of places around; 31 where not known
    has_flow: bool  # whether any orientation is known at all


@dataclass(frozen=True, slots=True, eq=False)
class PreparedTemplate:
    """One template of N minutiae ready for comparison, in px at 500 dpi with y pointing up.

    By its content, `key`, two templates are put in order, so that a comparison does not depend on
    which of them is the probe.
    """

    points: NDArray[np.float64]  # (4, N): x, y and the unit vector of the direction
    quality: NDArray[np.float64]  # (N,), 0 to 1; the usual one where the template gives none
    index: NDArray[np.int32]  # (N,): places among the template's minutiae
    neighbourhoods: Neighbourhoods
    region: PrintArea
    bit_descriptors: BitDescriptors
    to_500dpi: float  # 500 / dpi
    key: bytes

    def __len__(self) -> int:
        return len(self.index)


def which_encoded(quality: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which minutiae (N,) have words: of many, the best by quality."""
    coded = np.zeros(len(quality), bool)
    coded[np.argsort(-quality, kind="stable")[: fixed.MAX_ENCODED]] = True
    return coded


def direction_bins(points: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return the directions of minutiae (4, N) in 256ths of a turn."""
    turn = np.rint(np.arctan2(points[3], points[2]) * (fixed.TURNS / (2 * np.pi))).astype(np.int64)
    bins: NDArray[np.uint8] = (turn % fixed.TURNS).astype(np.uint8)
    return bins


def encode(
    points: NDArray[np.float64],
    coded: NDArray[np.bool_],
    direction_bin: NDArray[np.uint8],
    neighbours: Neighbourhoods,
    region: PrintArea,
    p: MatchParameters,
    scale: float = 1.0,
) -> BitDescriptors:
    """Encode those minutiae of a print (4, N) that are `coded`.

    All lengths of the print are multiplied by `scale`.
    """
    words = _neighbour_bits(neighbours, coded, scale / p.cell_px)
    around = _orientation_bins(points, direction_bin, region, scale)
    xy = (scale * points[:2].T).astype(np.float32, order="C")
    return BitDescriptors(xy, direction_bin, words, around, region.has_flow)


def _neighbour_bits(
    neighbours: Neighbourhoods, coded: NDArray[np.bool_], per_px: float
) -> NDArray[np.uint16]:
    """Return the words of the neighbours (N, 12).

    Of the neighbours of a minutia in one cell, the first counts.
    """
    frame = neighbours.frame[:, :4, : fixed.NEIGHBOUR_WORDS]
    t = np.arctan2(frame[:, 3], frame[:, 2]).astype(np.float64) / (2 * np.pi) + fixed.APART
    t = np.where(t < 0.0, t + 1.0, t) * fixed.SECTORS
    sector = np.minimum(t, fixed.SECTORS - 1).astype(np.int64)
    place = frame[:, :2].astype(np.float64).transpose(1, 0, 2) * per_px + fixed.CELLS_ALONG // 2
    at = place.astype(np.int64)
    (u, v), (column, row) = place, at
    on_column, on_row = place - at >= 0.5
    on_sector = t - sector >= 0.5
    rank, side = np.arange(frame.shape[2]), fixed.CELLS_ALONG
    inside = coded[:, None] & (rank < neighbours.count[:, None])
    inside &= (u >= 0.0) & (u < side) & (v >= 0.0) & (v < side)
    further = inside & (column + on_column < side) & (row + on_row < side)
    cell = (row * side + column) * fixed.SECTORS + sector
    second = fixed.SECOND + cell + on_sector + fixed.SECTORS * (on_column + side * on_row)
    word = cell | (4 * on_row + 2 * on_column + on_sector) << fixed.STEPS
    for counts, cells, bit in (
        (inside, cell, fixed.NOT_FIRST),
        (further, second, fixed.NOT_SECOND),
    ):
        place = np.where(counts, cells, ~rank).astype(np.int16)
        first = (place[..., None] == place[..., None, :]).argmax(axis=-1) == rank
        word |= np.where(counts & first, 0, bit)
    bits = np.full((len(coded), fixed.NEIGHBOUR_WORDS), fixed.NOWHERE, np.uint16)
    bits[:, : len(rank)] = np.where(inside, word, fixed.NOWHERE)
    return bits


def _orientation_bins(
    points: NDArray[np.float64], direction_bin: NDArray[np.uint8], region: PrintArea, scale: float
) -> NDArray[np.uint8]:
    """Return the bins of the orientation around each minutia, in its own frame, (N, 12)."""
    if not region.has_flow:
        return np.full((len(direction_bin), fixed.ORIENTATION_WORDS), fixed.UNKNOWN_BIN, np.uint8)
    z, d = points[::2] + 1j * points[1::2]
    around = (fixed.FLOW_PLACES[0] + 1j * fixed.FLOW_PLACES[1]) / scale
    code = codes_at(region, z[:, None] + d[:, None] * around)
    relative = (code - 1.0) * fixed.ORIENTATION_BINS / fixed.ORIENTATIONS
    relative -= direction_bin[:, None] * (2.0 * fixed.ORIENTATION_BINS / fixed.TURNS)
    relative %= fixed.ORIENTATION_BINS
    bins = np.minimum(relative.astype(np.int64), fixed.ORIENTATION_BINS - 1)
    return np.where(code > 0, bins, fixed.UNKNOWN_BIN).astype(np.uint8)


def prepare_by(
    neighbourhoods: Callable[[NDArray[np.float64], MatchParameters], Neighbourhoods],
    encode: Callable[..., BitDescriptors],
    template: Template,
    parameters: MatchParameters,
) -> PreparedTemplate:
    """Prepare a template by functions that describe its minutiae: neighbourhoods, then bits.

    Of too many minutiae those of best quality are kept, in the template's order.
    """
    p, minutiae = parameters, template.minutiae
    to_500dpi = STANDARD_DPI / template.dpi
    index = np.arange(len(minutiae), dtype=np.int32)
    if len(minutiae) > p.max_minutiae:
        best_first = np.argsort(-minutiae.quality.astype(np.int32), kind="stable")
        index = np.sort(best_first[: p.max_minutiae]).astype(np.int32)
        minutiae = minutiae.take(index)
    columns = np.empty((4, len(index)), np.float32)
    np.multiply(minutiae.x, to_500dpi, out=columns[0])
    np.multiply(minutiae.y, -to_500dpi, out=columns[1])
    angle = minutiae.angle.astype(np.float64)
    columns[2], columns[3] = np.cos(angle), np.sin(angle)
    points = columns.astype(np.float64)
    if template.field is not None:
        region = area_of_field(template.field, to_500dpi)
    else:
        region = area_of_hull(points, p.hull_step_px, p.max_hull_cells)
    quality = qualities(minutiae.quality, p.usual_quality)
    described = neighbourhoods(points, p)
    bits = encode(points, which_encoded(quality), direction_bins(points), described, region, p)
    r = region
    frame = _FRAME.pack(*r.code.shape, r.first_row, r.first_column, r.has_flow, r.step)
    ridges = b"" if r.ridges is None else r.ridges.tobytes()
    key = points.tobytes() + quality.tobytes() + r.code.tobytes() + frame + ridges
    return PreparedTemplate(points, quality, index, described, region, bits, to_500dpi, key)


def lies_off_ridges(side: PreparedTemplate) -> bool:
    """Return whether the minutiae of a print do not lie along its own ridges."""
    if not side.region.has_flow or len(side) < ENOUGH_ON_RIDGES:
        return False
    x, y, dx, dy = side.points
    code = codes_at(side.region, x + 1j * y)
    on, ridges = code > 0, (code - 1.0) * math.pi / fixed.ORIENTATIONS
    return lie_off_ridges(on, (np.arctan2(dy, dx) - ridges)[on])


def qualities(quality: NDArray[np.uint8], usual: float) -> NDArray[np.float64]:
    """Return the qualities of the minutiae of a print, 0 to 1, from 0 to 100.

    Where a print gives none, which is all 100 or all 0, they are the usual one, and so they are
    where a few minutiae have nearly all of the quality (`plausibility.are_uneven`): no extraction
    gives such qualities, by which most minutiae would count for nothing where they have no partner.
    """
    given = 0 < quality.sum() < 100 * len(quality)
    if given and not are_uneven(quality):
        return np.asarray(quality / 100.0)
    return np.full(len(quality), usual)
