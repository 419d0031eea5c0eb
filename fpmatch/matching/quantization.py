"""Quantization of a prepared print, so that a great many fit into memory.

A print is rounded when it is prepared, not when it is packed: so all comparisons, of two prints
or of one with many, are of the same values.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.prints._preparation_kernel import round_weights, write_codes
from fpmatch.matching.prints.neighbourhood import Neighbourhoods

if TYPE_CHECKING:
    from numpy.typing import NDArray

ORIENTATIONS: Final = 255  # steps of ridge orientation in half a turn; one code is left
ROOT_WEIGHTS: Final = np.arange(256) / 100.0  # of a neighbour; greater ones hardly occur
QUALITIES: Final = np.arange(256) / 100.0  # of a minutia, whose steps are the template's own


def orientation_codes(
    orientation: NDArray[np.floating], mask: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Return the codes of orientations in radians: 1 to `ORIENTATIONS`, and 0 outside the mask."""
    given = np.ascontiguousarray(orientation, np.float64)
    inside, code = np.ascontiguousarray(mask).view(np.uint8), np.empty(mask.shape, np.uint8)
    write_codes(given.reshape(-1), inside.reshape(-1), ORIENTATIONS / np.pi, code.reshape(-1))
    return code


def rounded(given: Neighbourhoods) -> Neighbourhoods:
    """Return neighbourhoods whose weights are rounded."""
    frame = given.frame.copy()
    n, _, size = frame.shape
    round_weights(frame[:, 5], np.empty((n, size), np.uint8))
    return Neighbourhoods(given.count, given.neighbour, frame)


def root_weight_codes(root_weight: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return which of `ROOT_WEIGHTS` the square roots of neighbours' weights are nearest to."""
    code = np.empty(root_weight.shape, np.uint8)
    round_weights(root_weight.copy().reshape(-1, 1), code.reshape(-1, 1))
    return code
