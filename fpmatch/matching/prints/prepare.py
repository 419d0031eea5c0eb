"""Prepare a template for the compiled matcher."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.prints.bit_descriptors import encode, encode_many
from fpmatch.matching.prints.neighbourhood import neighbourhoods
from fpmatch.matching.prints.parameters import PreparationParameters
from fpmatch.matching.prints.prepared import (
    BitDescriptors,
    PreparedTemplate,
    best_minutiae,
    content_key,
    points_at_500dpi,
    qualities,
    rounded,
)
from fpmatch.matching.prints.print_area import PrintAreas, area_of_field, area_of_hull
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.bit_descriptors import EncodedMinutiae
    from fpmatch.matching.prints.parameters import BitDescriptorParameters, NeighbourhoodParameters
    from fpmatch.matching.prints.prepared import Neighbourhoods
    from fpmatch.templates.minutiae import Template


def prepare(
    template: Template,
    parameters: PreparationParameters | None = None,
    neighbourhood: NeighbourhoodParameters | None = None,
    prefilter: BitDescriptorParameters | None = None,
) -> PreparedTemplate:
    """Triangulate the minutiae of a template and describe their neighbourhoods."""
    p = parameters or PreparationParameters()
    to_500dpi = STANDARD_DPI / template.dpi
    index = best_minutiae(template.minutiae, p.max_minutiae)
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
