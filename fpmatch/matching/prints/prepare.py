"""Prepared templates: what a matcher computes once for all comparisons of a template."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.parameters import parameter
from fpmatch.matching.prints._kernels._preparation_kernel import write_qualities
from fpmatch.matching.prints._kernels._template_view_kernel import TemplateView
from fpmatch.matching.prints.bit_descriptors import (
    BitDescriptorParameters,
    BitDescriptors,
    encode,
    encode_many,
)
from fpmatch.matching.prints.neighbourhood import (
    NeighbourhoodParameters,
    Neighbourhoods,
    neighbourhoods,
    rounded,
)
from fpmatch.matching.prints.print_area import PrintArea, PrintAreas, area_of_field, area_of_hull
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.bit_descriptors import EncodedMinutiae
    from fpmatch.templates.minutiae import Minutiae, Template

_FRAME: Final = struct.Struct("=qqqqqd")  # of a region, in its content


@dataclass(frozen=True, slots=True)
class PreparationParameters:
    """Preparation of a template.

    Where it has no ridge field, the cells of the minutiae's hull stand for the print.
    """

    max_minutiae: int = parameter(
        200, "minutiae that take part; of more, those of best quality", 1, 256
    )
    hull_step_px: float = parameter(
        16.0, "side of a cell of the hull, where a template has no ridge field", 4, 64
    )
    max_hull_cells: int = parameter(
        512, "such cells along a side; larger ones where the minutiae reach farther", 16, 512
    )
    usual_quality: float = parameter(
        0.7, "quality where a template gives none: all are 100, or all 0", 0, 1
    )


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
        n, r, c = self.neighbourhoods, self.region, self.bit_descriptors
        print_ = TemplateView(self.points, self.quality, n.count, n.frame)
        print_.set_bit_descriptors(c.xy, c.direction_bin, c.neighbour_bits, c.orientation_bins)
        print_.set_region(
            r.code, r.ridges, r.first_row, r.first_column, r.step, r.inside, r.has_flow
        )
        return print_


def available(probe: PreparedTemplate, reference: PreparedTemplate) -> tuple[int, float]:
    """Return the least number of minutiae, and the least area in square pixels at 500 dpi."""
    sides = (probe, reference)
    area = min(side.region.inside * side.region.step**2 for side in sides)
    return min(map(len, sides)), area


def prepare(
    template: Template,
    parameters: PreparationParameters | None = None,
    neighbourhood: NeighbourhoodParameters | None = None,
    prefilter: BitDescriptorParameters | None = None,
) -> PreparedTemplate:
    """Triangulate the minutiae of a template and describe their neighbourhoods."""
    p = parameters or PreparationParameters()
    to_500dpi = STANDARD_DPI / template.dpi
    index = _best(template.minutiae, p.max_minutiae)
    all_of_them = len(index) == len(template.minutiae)
    minutiae = template.minutiae if all_of_them else template.minutiae.take(index)
    points = points_at_500dpi(minutiae.x, minutiae.y, minutiae.angle, to_500dpi)
    if template.field is not None:
        region = area_of_field(template.field, to_500dpi)
    else:
        region = area_of_hull(points, p.hull_step_px, p.max_hull_cells)
    start = np.array((0, len(index)), np.int64)
    quality = qualities(minutiae.quality, start, p.usual_quality)
    areas = PrintAreas.of(region)
    described, bits = describe(points, quality, start, areas, neighbourhood, prefilter)
    xy = np.ascontiguousarray(points[:2].T, np.float32)
    return PreparedTemplate(
        points=points,
        quality=quality,
        index=index,
        neighbourhoods=described,
        region=region,
        bit_descriptors=BitDescriptors(xy, *bits, region.has_flow),
        to_500dpi=to_500dpi,
        key=content_key(points, quality, region),
    )


def describe(
    points: NDArray[np.float64],
    quality: NDArray[np.float64],
    start: NDArray[np.int64],
    areas: PrintAreas,
    neighbourhood: NeighbourhoodParameters | None = None,
    prefilter: BitDescriptorParameters | None = None,
) -> tuple[Neighbourhoods, EncodedMinutiae]:
    """Describe the minutiae of many prints: their neighbourhoods, and what `encode_many` returns.

    Those of print k are from ``start[k]`` up to the next.
    """
    described = rounded(neighbourhoods(points, neighbourhood, start.tolist()))
    return described, encode_many(points, quality, start, described, areas, prefilter)


def points_at_500dpi(
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    angle: NDArray[np.float32],
    to_500dpi: float | NDArray[np.float32],
) -> NDArray[np.float64]:
    """Return the points of a prepared template, of minutiae in the pixels of their images."""
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

    Where a print gives none, which is all 100 or all 0, they are the usual one, and so they are
    where a few minutiae have nearly all of the quality, as in no print.
    """
    scaled = np.empty(len(quality))
    write_qualities(quality, start, usual, scaled)
    return scaled


def rescaled_descriptors(
    prepared: PreparedTemplate, ratio: float, prefilter: BitDescriptorParameters | None = None
) -> BitDescriptors:
    """Return the bit descriptors of a print whose lengths are multiplied by `ratio`."""
    p = prepared
    frame = p.neighbourhoods.frame.copy()
    frame[:, :2] *= ratio
    points = p.points.copy()
    points[:2] *= ratio
    neighbours = replace(p.neighbourhoods, frame=frame)
    region = replace(p.region, step=p.region.step * ratio)
    return encode(points, p.quality, neighbours, region, prefilter)


def content_key(
    points: NDArray[np.float64], quality: NDArray[np.float64], region: PrintArea
) -> bytes:
    """Return the content of a print as bytes, by which prints are put in order."""
    r = region
    frame = _FRAME.pack(*r.code.shape, r.first_row, r.first_column, r.has_flow, r.step)
    ridges = b"" if r.ridges is None else r.ridges.tobytes()
    return points.tobytes() + quality.tobytes() + r.code.tobytes() + frame + ridges


def _best(minutiae: Minutiae, count: int) -> NDArray[np.int32]:
    """Return the indices, in order, of the `count` minutiae of best quality."""
    if len(minutiae) <= count:
        return np.arange(len(minutiae), dtype=np.int32)
    best = np.argsort(-minutiae.quality.astype(np.int32), kind="stable")[:count]
    return np.sort(best).astype(np.int32)
