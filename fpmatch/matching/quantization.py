"""Quantization of a prepared print, so that a great many fit into memory.

A print is rounded when it is prepared, not when it is packed: so all comparisons, of two prints
or of one with many, are of the same values.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.neighbourhood import Neighbourhoods

if TYPE_CHECKING:
    from numpy.typing import NDArray

ORIENTATIONS: Final = 255  # steps of ridge orientation in half a turn; one code is left
ROOT_WEIGHTS: Final = np.arange(256) / 100.0  # of a neighbour; greater ones hardly occur
QUALITIES: Final = np.arange(256) / 100.0  # of a minutia, whose steps are the template's own


def orientation_codes(
    orientation: NDArray[np.floating], mask: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Return the codes of orientations in radians: 1 to `ORIENTATIONS`, and 0 outside the mask."""
    known = np.where(mask, orientation, 0.0).astype(np.float64)
    step = np.rint(known * (ORIENTATIONS / np.pi)).astype(np.int64)
    step -= step // ORIENTATIONS * ORIENTATIONS  # faster than the remainder
    return np.where(mask, step + 1, 0).astype(np.uint8)


def rounded(found: Neighbourhoods) -> Neighbourhoods:
    """Return neighbourhoods whose weights are rounded."""
    frame = found.frame.copy()
    frame[:, 5] = ROOT_WEIGHTS[root_weight_codes(frame[:, 5])]
    return Neighbourhoods(found.count, found.neighbour, frame)


def root_weight_codes(root_weight: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return which of `ROOT_WEIGHTS` the square roots of neighbours' weights are nearest to."""
    return np.minimum(np.rint(root_weight.astype(np.float64) * 100.0), 255).astype(np.uint8)
