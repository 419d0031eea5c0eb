"""Bit descriptors: a fast, coarse comparison of two prints, for the prefilter.

Two minutiae are compared by counting the words of `_encode_kernel` that they share; two prints by
the pairs of minutiae that share enough and agree in one rotation and shift. That takes a few
hundredths of the time of a whole comparison, and rejects most impostor pairs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.constants.prints import (
    MAX_ENCODED,
    NEIGHBOUR_WORDS,
    ORIENTATION_WORDS,
    TURNS,
)
from fpmatch.matching.prints._kernels._encode_kernel import encode_neighbours, encode_orientations
from fpmatch.matching.prints._kernels._prefilter_kernel import Prefilter
from fpmatch.matching.prints.parameters import BitDescriptorParameters

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import BitDescriptors, Neighbourhoods
    from fpmatch.matching.prints.print_area import PrintAreas

    EncodedMinutiae: TypeAlias = tuple[NDArray[np.uint8], NDArray[np.uint16], NDArray[np.uint8]]

_USUAL: Final = BitDescriptorParameters()
_PLACES: Final = _USUAL.places


def encode_many(
    points: NDArray[np.float64],
    quality: NDArray[np.float64],
    start: NDArray[np.int64],
    neighbours: Neighbourhoods,
    areas: PrintAreas,
    parameters: BitDescriptorParameters | None = None,
) -> EncodedMinutiae:
    """Encode the minutiae of many prints, each from an entry of `start` up to the next.

    Return direction bins, bits of neighbours and bins of orientation, as `BitDescriptors` has them.
    """
    n = points.shape[1]
    coded = np.ones(n, np.uint8)
    for k in (start[1:] - start[:-1] > MAX_ENCODED).nonzero()[0].tolist():
        of = slice(start[k], start[k + 1])
        coded[of][np.argsort(-quality[of], kind="stable")[MAX_ENCODED:]] = 0
    turn = np.rint(np.arctan2(points[3], points[2]) * (TURNS / (2 * np.pi))).astype(np.int64)
    direction_bin = (turn % TURNS).astype(np.uint8)
    angle = np.arctan2(neighbours.frame[:, 3], neighbours.frame[:, 2])
    neighbour_bits = np.empty((n, NEIGHBOUR_WORDS), np.uint16)
    orientation_bins = np.empty((n, ORIENTATION_WORDS), np.uint8)
    p = parameters or _USUAL
    of_neighbours = neighbours.count, neighbours.frame, angle, coded
    encode_neighbours(*of_neighbours, 1.0 / p.cell_px, neighbour_bits)
    place = start, areas.code, areas.start, areas.shape, areas.step, areas.has_flow
    encode_orientations(points, direction_bin, *place, _PLACES, orientation_bins)
    return direction_bin, neighbour_bits, orientation_bins


def prefilter(parameters: BitDescriptorParameters | None = None) -> Prefilter:
    """Return an empty prefilter, for one thread."""
    p = parameters or _USUAL
    return Prefilter(p.most_pairs, p.near_px, p.near_per_px, round(p.pair_turn_deg * TURNS / 360))


def prefilter_of(descriptors: BitDescriptors) -> Prefilter:
    """Return a prefilter with a print in its tables."""
    made, d = prefilter(), descriptors
    made.load(d.xy, d.direction_bin, d.neighbour_bits, d.orientation_bins, d.has_flow)
    return made


def score_descriptors(tables: Prefilter, b: BitDescriptors) -> int:
    """Return how much print B has in common with the print in the tables, which comes first."""
    bits = b.direction_bin, b.neighbour_bits, b.orientation_bins, b.has_flow
    weight: int = tables.score(0, len(b.xy), b.xy, *bits, False)
    return weight
