"""Prepare a template for the compiled matcher: neighbourhoods and bit descriptors of its minutiae.

The paper compares whole one-rings of points. So that a neighbourhood is recognised although
neighbours are missing or spurious, each neighbour is kept by itself, with its shape-preserving
weight (eq. 4) and its position and direction in the frame of the minutia's own direction; points
of the second ring make up the number.

Bit descriptors are a fast, coarse comparison of two prints, the prefilter. Two minutiae are
compared by counting the words of `_encode_kernel` that they share; two prints by the pairs of
minutiae that share enough and agree in one rotation and shift. That takes a few hundredths of the
time of a whole comparison, and rejects most impostor pairs.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.constants.prints import (
    FLOW_PLACES,
    MAX_ENCODED,
    NEIGHBOUR_WORDS,
    ORIENTATION_WORDS,
    TURNS,
    UNKNOWN_BIN,
)
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.prints._kernels._encode_kernel import encode_neighbours, encode_orientations
from fpmatch.matching.prints._kernels._neighbourhood_kernel import NeighbourhoodWriter
from fpmatch.matching.prints._kernels._prefilter_kernel import Prefilter
from fpmatch.matching.prints.prepared import BitDescriptors, Neighbourhoods, prepare_by
from fpmatch.matching.prints.print_area import PrintAreas
from fpmatch.pointset.delaunay.triangulate import triangulate_checked

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.matching.prints.print_area import PrintArea
    from fpmatch.templates.minutiae import Template

    EncodedMinutiae: TypeAlias = tuple[NDArray[np.uint8], NDArray[np.uint16], NDArray[np.uint8]]


def prepare(template: Template, parameters: MatchParameters = USUAL) -> PreparedTemplate:
    """Triangulate the minutiae of a template and describe their neighbourhoods."""

    def describe_one(
        points: NDArray[np.float64], quality: NDArray[np.float64], region: PrintArea
    ) -> tuple[Neighbourhoods, BitDescriptors]:
        start, r, areas = np.array((0, len(quality)), np.int64), region, None
        if r.has_flow:
            shape = np.array(((*r.code.shape, r.first_row, r.first_column),), np.int32)
            cells = np.array((0, r.code.size), np.int64)
            areas = PrintAreas(cells, r.code.reshape(-1), shape, np.array((r.step,), np.float64))
        described, bits = describe(points, quality, start, areas, parameters)
        xy = np.ascontiguousarray(points[:2].T, np.float32)
        return described, BitDescriptors(xy, *bits, region.has_flow)

    return prepare_by(describe_one, template, parameters)


def describe(
    points: NDArray[np.float64],
    quality: NDArray[np.float64],
    start: NDArray[np.int64],
    areas: PrintAreas | None,
    parameters: MatchParameters = USUAL,
) -> tuple[Neighbourhoods, EncodedMinutiae]:
    """Describe the minutiae of many prints, each from an entry of `start` up to the next.

    Return their neighbourhoods, numbered from the print's first minutia, with direction bins, bits
    of neighbours and bins of orientation, as `BitDescriptors` has them.
    """
    p, n = parameters, points.shape[1]
    count = np.empty(n, np.int32)
    neighbour = np.zeros((n, p.neighbours), np.int32)
    frame = np.zeros((n, 6, p.neighbours), np.float32)
    coded = np.ones(n, np.uint8)
    bounds = list(pairwise(start.tolist()))
    most = max((end - first for first, end in bounds), default=0)
    writer = NeighbourhoodWriter(points, p, most, count, neighbour, frame)
    for first, end in bounds:
        mesh = triangulate_checked(points[:2, first:end].T.copy())
        closed = mesh.interior.view(np.uint8)
        writer.write(first, mesh.edges, mesh.ring_start, mesh.ring, closed)
        if end - first > MAX_ENCODED:
            best_first = np.argsort(-quality[first:end], kind="stable")
            coded[first:end][best_first[MAX_ENCODED:]] = 0
    turn = np.rint(np.arctan2(points[3], points[2]) * (TURNS / (2 * np.pi))).astype(np.int64)
    direction_bin = turn.astype(np.uint8)  # 256 steps are a turn
    angle = np.arctan2(frame[:, 3], frame[:, 2])
    neighbour_bits = np.empty((n, NEIGHBOUR_WORDS), np.uint16)
    encode_neighbours(count, frame, angle, coded, 1.0 / p.cell_px, neighbour_bits)
    orientation_bins = np.full((n, ORIENTATION_WORDS), UNKNOWN_BIN, np.uint8)
    if areas is not None:
        encode_orientations(points, direction_bin, start, *areas, FLOW_PLACES, orientation_bins)
    encoded = direction_bin, neighbour_bits, orientation_bins
    return Neighbourhoods(count, neighbour, frame), encoded


def prefilter_of(descriptors: BitDescriptors) -> Prefilter:
    """Return a prefilter of the usual parameters with a print in its tables."""
    made, d = Prefilter(USUAL), descriptors
    made.load(d.xy, d.direction_bin, d.neighbour_bits, d.orientation_bins, d.has_flow)
    return made


def score_descriptors(tables: Prefilter, b: BitDescriptors) -> int:
    """Return how much print B has in common with the print in the tables, which comes first."""
    bits = b.direction_bin, b.neighbour_bits, b.orientation_bins, b.has_flow
    weight: int = tables.score(0, len(b.xy), b.xy, *bits, False)
    return weight
