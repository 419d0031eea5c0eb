"""Prepare a template for the compiled matcher."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.prints.bit_descriptors import encode_many
from fpmatch.matching.prints.neighbourhood import neighbourhoods
from fpmatch.matching.prints.prepared import BitDescriptors, prepare_by, rounded
from fpmatch.matching.prints.print_area import PrintAreas

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.bit_descriptors import EncodedMinutiae
    from fpmatch.matching.prints.parameters import (
        BitDescriptorParameters,
        NeighbourhoodParameters,
        PreparationParameters,
    )
    from fpmatch.matching.prints.prepared import Neighbourhoods, PreparedTemplate
    from fpmatch.matching.prints.print_area import PrintArea
    from fpmatch.templates.minutiae import Template


def prepare(
    template: Template,
    parameters: PreparationParameters | None = None,
    neighbourhood: NeighbourhoodParameters | None = None,
    prefilter: BitDescriptorParameters | None = None,
) -> PreparedTemplate:
    """Triangulate the minutiae of a template and describe their neighbourhoods."""

    def describe_one(
        points: NDArray[np.float64], quality: NDArray[np.float64], region: PrintArea
    ) -> tuple[Neighbourhoods, BitDescriptors]:
        start, areas = np.array((0, len(quality)), np.int64), PrintAreas.of(region)
        described, bits = describe(points, quality, start, areas, neighbourhood, prefilter)
        xy = np.ascontiguousarray(points[:2].T, np.float32)
        return described, BitDescriptors(xy, *bits, region.has_flow)

    return prepare_by(describe_one, template, parameters)


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
