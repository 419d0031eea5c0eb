"""Prepare a template for the compiled matcher: neighbourhoods and bit descriptors of its minutiae.

The paper compares whole one-rings of points. So that a neighbourhood is recognised although
neighbours are missing or spurious, each neighbour is kept by itself, with its shape-preserving
weight (eq. 4) and its position and direction in the frame of the minutia's own direction; points
of the second ring make up the number.

Bit descriptors are a fast, coarse comparison of two prints, the prefilter. Two minutiae are
compared by counting the words that they share; two prints by the pairs of
minutiae that share enough and agree in one rotation and shift. That takes a few hundredths of the
time of a whole comparison, and rejects most impostor pairs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching import constants as fixed
from fpmatch.matching.parameters import USUAL, MatchParameters
from fpmatch.matching.prints._kernels._encode_kernel import encode_neighbours, encode_orientations
from fpmatch.matching.prints._kernels._neighbourhood_kernel import NeighbourhoodWriter
from fpmatch.matching.prints._kernels._prefilter_kernel import Prefilter
from fpmatch.matching.prints.prepared import (
    BitDescriptors,
    Neighbourhoods,
    prepare_by,
)
from fpmatch.pointset.delaunay.triangulate import triangulate_checked

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate, PrintArea
    from fpmatch.templates.minutiae import Template


def prepare(template: Template, parameters: MatchParameters = USUAL) -> PreparedTemplate:
    """Triangulate the minutiae of a template and describe their neighbourhoods."""
    return prepare_by(neighbourhoods, encode, template, parameters)


def neighbourhoods(points: NDArray[np.float64], parameters: MatchParameters) -> Neighbourhoods:
    """Describe the nearest neighbours, in the first two rings, of minutiae (4, N)."""
    count = np.empty(points.shape[1], np.int32)
    frame = np.zeros((len(count), 6, parameters.neighbours), np.float32)
    mesh = triangulate_checked(points[:2].T.copy())
    writer = NeighbourhoodWriter(points, parameters, count, frame)
    writer.write(mesh.edges, mesh.ring_start, mesh.ring, mesh.interior.view(np.uint8))
    return Neighbourhoods(count, frame)


def encode(
    points: NDArray[np.float64],
    coded: NDArray[np.bool_],
    direction_bin: NDArray[np.uint8],
    neighbours: Neighbourhoods,
    region: PrintArea,
    parameters: MatchParameters,
    scale: float = 1.0,
) -> BitDescriptors:
    """Encode the minutiae (4, N) of a print as `prepared.encode` does."""
    r, n, count, frame = region, len(coded), neighbours.count, neighbours.frame
    xy, places = points[:2].T, fixed.FLOW_PLACES
    if scale != 1.0:
        xy, places = scale * xy, places / scale
    angle = np.arctan2(frame[:, 3], frame[:, 2])
    neighbour_bits = np.empty((n, fixed.NEIGHBOUR_WORDS), np.uint16)
    per_px, which = scale / parameters.cell_px, coded.view(np.uint8)
    encode_neighbours(count, frame, angle, which, per_px, neighbour_bits)
    orientation_bins = np.full((n, fixed.ORIENTATION_WORDS), fixed.UNKNOWN_BIN, np.uint8)
    if r.has_flow:
        area = r.code, r.first_row, r.first_column, r.step
        encode_orientations(points, direction_bin, *area, places, orientation_bins)
    at = np.ascontiguousarray(xy, np.float32)
    return BitDescriptors(at, direction_bin, neighbour_bits, orientation_bins, r.has_flow)


def prefilter_of(descriptors: BitDescriptors, parameters: MatchParameters = USUAL) -> Prefilter:
    """Return a prefilter with a print in its tables."""
    made, d = Prefilter(parameters), descriptors
    made.load(d.xy, d.direction_bin, d.neighbour_bits, d.orientation_bins, d.has_flow)
    return made


def score_descriptors(tables: Prefilter, b: BitDescriptors) -> int:
    """Return how much print B has in common with the print in the tables, which comes first."""
    bits = b.direction_bin, b.neighbour_bits, b.orientation_bins, b.has_flow
    weight: int = tables.score(0, len(b.xy), b.xy, *bits, False)
    return weight
