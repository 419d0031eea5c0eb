"""Prepared templates: what a matcher computes once for all comparisons of a template."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.constants.prints import ORIENTATIONS
from fpmatch.matching.prints.print_area import area_of_field, area_of_hull, codes_at
from fpmatch.templates.minutiae import STANDARD_DPI
from fpmatch.templates.plausibility import (
    ENOUGH_ON_RIDGES,
    FEW_MINUTIAE,
    LEAST_EVEN,
    LEAST_EVEN_OF_FEW,
    lie_off_ridges,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.matching.parameters import MatchParameters
    from fpmatch.matching.prints.print_area import PrintArea
    from fpmatch.templates.minutiae import Template

ROOT_WEIGHTS: Final = np.arange(256) / 100.0  # of a neighbour; greater ones hardly occur
_FRAME: Final = struct.Struct("=qqqqqd")  # of a region, in its content


@dataclass(frozen=True, slots=True, eq=False)
class Neighbourhoods:
    """The neighbourhoods of N minutiae as flat arrays.

    In the frame of a minutia its direction is +u. A neighbour has its position u, v, its direction
    c, s, 1/tolerance² and its weight.
    """

    count: NDArray[np.int32]  # (N,): neighbours kept of each minutia
    neighbour: NDArray[np.int32]  # (N, size): which minutiae; beyond the number kept, any
    frame: NDArray[np.float32]  # (N, 6, size): the neighbours in the frame of the minutia


@dataclass(frozen=True, slots=True, eq=False)
class BitDescriptors:
    """The bit descriptors of a print of N minutiae; `_encode_kernel` describes the words."""

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


def prepare_by(
    describe: Callable[
        [NDArray[np.float64], NDArray[np.float64], PrintArea, MatchParameters],
        tuple[Neighbourhoods, BitDescriptors],
    ],
    template: Template,
    parameters: MatchParameters,
) -> PreparedTemplate:
    """Prepare a template by a function that describes minutiae (4, N) of a quality in an area.

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
    described, bits = describe(points, quality, region, p)
    key = content_key(points, quality, region)
    return PreparedTemplate(points, quality, index, described, region, bits, to_500dpi, key)


def lies_off_ridges(side: PreparedTemplate) -> bool:
    """Return whether the minutiae of a print do not lie along its own ridges."""
    if not side.region.has_flow or len(side) < ENOUGH_ON_RIDGES:
        return False
    x, y, dx, dy = side.points
    code = codes_at(side.region, x + 1j * y)
    on, ridges = code > 0, (code - 1.0) * math.pi / ORIENTATIONS
    return lie_off_ridges(on, (np.arctan2(dy, dx) - ridges)[on])


def qualities(quality: NDArray[np.uint8], usual: float) -> NDArray[np.float64]:
    """Return the qualities of the minutiae of a print, 0 to 1, from 0 to 100.

    Where a print gives none, which is all 100 or all 0, they are the usual one, and so they are
    where a few minutiae have nearly all of the quality (`plausibility.why_no_finger`): no
    extraction gives such qualities, by which most minutiae would count for nothing where they have
    no partner.
    """
    value, count = quality.astype(np.float64), len(quality)
    total = value @ value
    even = np.minimum(count * (value * value), total).sum()  # by `count`
    least = LEAST_EVEN if count >= FEW_MINUTIAE else LEAST_EVEN_OF_FEW
    if 0.0 < total < 10_000.0 * count and even >= least * count * total:
        return np.asarray(value / 100.0)
    return np.full(count, usual)


def root_weight_codes(root_weight: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return which of `ROOT_WEIGHTS` the square roots of neighbours' weights are nearest to.

    The weights are rounded to these when a print is prepared, not when it is put into arrays: so
    all comparisons, of two prints or of one with many, are of the same values.
    """
    step = np.rint(root_weight * np.float64(100.0))
    return np.minimum(step, len(ROOT_WEIGHTS) - 1.0).astype(np.uint8)


def content_key(
    points: NDArray[np.float64], quality: NDArray[np.float64], region: PrintArea
) -> bytes:
    """Return the content of a print as bytes, by which prints are put in order."""
    r = region
    frame = _FRAME.pack(*r.code.shape, r.first_row, r.first_column, r.has_flow, r.step)
    ridges = b"" if r.ridges is None else r.ridges.tobytes()
    return points.tobytes() + quality.tobytes() + r.code.tobytes() + frame + ridges
