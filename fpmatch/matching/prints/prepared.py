"""Prepared templates: what a matcher computes once for all comparisons of a template."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.constants.prints import ORIENTATIONS
from fpmatch.matching.parameters import USUAL, MatchParameters
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

    from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
    from fpmatch.matching.prints.print_area import PrintArea
    from fpmatch.templates.minutiae import Minutiae, Template

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

    def for_kernels(self) -> TemplateView:
        """Return a view of the print for the kernels."""
        from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView  # noqa: PLC0415

        n, r, c = self.neighbourhoods, self.region, self.bit_descriptors
        print_ = TemplateView(self.points, self.quality, n.count, n.frame)
        print_.set_bit_descriptors(c.xy, c.direction_bin, c.neighbour_bits, c.orientation_bins)
        print_.set_region(
            r.code, r.ridges, r.first_row, r.first_column, r.step, r.inside, r.has_flow
        )
        return print_


def prepare_by(
    describe: Callable[
        [NDArray[np.float64], NDArray[np.float64], PrintArea],
        tuple[Neighbourhoods, BitDescriptors],
    ],
    template: Template,
    parameters: MatchParameters | None = None,
) -> PreparedTemplate:
    """Prepare a template by a function that describes minutiae (4, N) of a quality in an area."""
    p = parameters or USUAL
    to_500dpi = STANDARD_DPI / template.dpi
    index = best_minutiae(template.minutiae, p.max_minutiae)
    all_of_them = len(index) == len(template.minutiae)
    minutiae = template.minutiae if all_of_them else template.minutiae.take(index)
    points = points_at_500dpi(minutiae.x, minutiae.y, minutiae.angle, to_500dpi)
    if template.field is not None:
        region = area_of_field(template.field, to_500dpi)
    else:
        region = area_of_hull(points, p.hull_step_px, p.max_hull_cells)
    quality = qualities(minutiae.quality, np.array((0, len(index))), p.usual_quality)
    described, bits = describe(points, quality, region)
    return PreparedTemplate(
        points=points,
        quality=quality,
        index=index,
        neighbourhoods=described,
        region=region,
        bit_descriptors=bits,
        to_500dpi=to_500dpi,
        key=content_key(points, quality, region),
    )


def available(probe: PreparedTemplate, reference: PreparedTemplate) -> tuple[int, float]:
    """Return the minutiae and the area, px² at 500 dpi, of the smaller print in each respect."""
    sides = (probe, reference)
    area = min(side.region.inside * side.region.step**2 for side in sides)
    return min(map(len, sides)), area


def lies_off_ridges(side: PreparedTemplate) -> bool:
    """Return whether the minutiae of a print do not lie along its own ridges."""
    if not side.region.has_flow or len(side) < ENOUGH_ON_RIDGES:
        return False
    x, y, dx, dy = side.points
    code = codes_at(side.region, x + 1j * y)
    on, ridges = code > 0, (code - 1.0) * math.pi / ORIENTATIONS
    return lie_off_ridges(on, (np.arctan2(dy, dx) - ridges)[on])


def points_at_500dpi(
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    angle: NDArray[np.float32],
    to_500dpi: float | NDArray[np.float32],
) -> NDArray[np.float64]:
    """Return minutiae in pixels and radians, each (N,), as the points (4, N) of a prepared one."""
    columns = np.empty((4, len(x)), np.float32)
    np.multiply(x, to_500dpi, out=columns[0])
    np.multiply(y, -to_500dpi, out=columns[1])
    turn = angle.astype(np.float64)
    columns[2], columns[3] = np.cos(turn), np.sin(turn)
    return columns.astype(np.float64)


def qualities(
    quality: NDArray[np.uint8], start: NDArray[np.int64], usual: float
) -> NDArray[np.float64]:
    """Return the qualities of the minutiae of many prints, 0 to 1, from 0 to 100.

    Print k has the minutiae from ``start[k]`` up to the next. Where a print gives none, which is
    all 100 or all 0, they are the usual one, and so they are where a few minutiae have nearly all
    of the quality (`plausibility.why_no_finger`): no extraction gives such qualities, by which most
    minutiae would count for nothing where they have no partner.
    """
    scaled = quality / 100.0
    for first, end in pairwise(start.tolist()):
        value = quality[first:end].astype(np.int64)
        count, squares = len(value), value * value
        total = int(squares.sum())
        even = int(np.minimum(count * squares, total).sum())  # by `count`
        least = LEAST_EVEN if count >= FEW_MINUTIAE else LEAST_EVEN_OF_FEW
        given = 0 < int(value.sum()) < 100 * count and even >= least * count * total
        if not given:
            scaled[first:end] = usual
    return np.asarray(scaled)


def root_weight_codes(root_weight: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return which of `ROOT_WEIGHTS` the square roots of neighbours' weights are nearest to."""
    step = np.rint(root_weight * np.float64(100.0))
    return np.minimum(step, len(ROOT_WEIGHTS) - 1.0).astype(np.uint8)


def rounded(given: Neighbourhoods) -> Neighbourhoods:
    """Round the weights of neighbourhoods so that a byte keeps each of them.

    They are rounded when a print is prepared, not when it is put into arrays: so all comparisons,
    of two prints or of one with many, are of the same values.
    """
    given.frame[:, 5] = ROOT_WEIGHTS[root_weight_codes(given.frame[:, 5])]
    return given


def content_key(
    points: NDArray[np.float64], quality: NDArray[np.float64], region: PrintArea
) -> bytes:
    """Return the content of a print as bytes, by which prints are put in order."""
    r = region
    frame = _FRAME.pack(*r.code.shape, r.first_row, r.first_column, r.has_flow, r.step)
    ridges = b"" if r.ridges is None else r.ridges.tobytes()
    return points.tobytes() + quality.tobytes() + r.code.tobytes() + frame + ridges


def best_minutiae(minutiae: Minutiae, count: int) -> NDArray[np.int32]:
    """Return the indices, in order, of the `count` minutiae of best quality."""
    if len(minutiae) <= count:
        return np.arange(len(minutiae), dtype=np.int32)
    best = np.argsort(-minutiae.quality.astype(np.int32), kind="stable")[:count]
    return np.sort(best).astype(np.int32)
