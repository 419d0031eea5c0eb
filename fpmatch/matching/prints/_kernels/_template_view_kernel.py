# mypy: ignore-errors
"""Kernel: a prepared print as the other kernels see it.

Minutiae, neighbourhoods and areas are as `fpmatch.matching.prints.prepared` has them.
"""

import cython
import numpy as np

from fpmatch.matching import constants
from fpmatch.templates import plausibility

ENOUGH_ON_RIDGES = cython.declare(cython.Py_ssize_t, plausibility.ENOUGH_ON_RIDGES)
LEAST_INSIDE = cython.declare(cython.double, plausibility.LEAST_INSIDE)
LEAST_ALONG = cython.declare(cython.double, plausibility.LEAST_ALONG)

_TURN = 2.0 * np.pi * (np.arange(constants.ORIENTATIONS + 1) - 1.0) / constants.ORIENTATIONS
FLOW_OF_CODE = np.stack([np.cos(_TURN), np.sin(_TURN)])  # of twice the orientation of a code
FLOW = cython.declare(cython.double[:, ::1], FLOW_OF_CODE)


@cython.final
@cython.cclass
class TemplateView:
    """A prepared print: its minutiae, neighbourhoods, bit descriptors, and the cells of its area.

    `size` is the number of minutiae.
    """

    def __init__(self, prepared) -> None:
        bits, region = prepared.bit_descriptors, prepared.region
        self.size, self.points, self.quality = len(prepared), prepared.points, prepared.quality
        self.count, self.frame = prepared.neighbourhoods.count, prepared.neighbourhoods.frame
        self.xy, self.direction_bin = bits.xy, bits.direction_bin
        self.neighbour_bits, self.orientation_bins = bits.neighbour_bits, bits.orientation_bins
        self.cell, (self.rows, self.columns) = region.code, region.code.shape
        self.first_row, self.first_column = region.first_row, region.first_column
        self.step, self.per_px, self.inside = region.step, 1.0 / region.step, region.inside
        self.has_flow, self.has_ridges = region.has_flow, region.ridges is not None
        if self.has_ridges:
            self.ridges = region.ridges

    def lies_off_ridges(self):
        """Return whether few minutiae lie on the ridges, or most across."""
        if not self.has_flow or self.size < ENOUGH_ON_RIDGES:
            return False
        on: cython.Py_ssize_t = 0
        along: cython.double = 0.0
        for i in range(self.size):
            code: cython.Py_ssize_t = self.code_at(self.points[0, i], self.points[1, i])
            if code > 0:
                x, y = self.points[2, i], self.points[3, i]
                on += 1
                along += (x * x - y * y) * FLOW[0, code] + 2.0 * x * y * FLOW[1, code]
        return on < LEAST_INSIDE * self.size or along < LEAST_ALONG * on

    def contains(self, x, y):
        """Return whether a place lies in the print area."""
        return self.code_at(x, y) > 0

    def code_at(self, x, y):
        """Return the code of the cell at a place; 0 outside."""
        x = x * self.per_px - self.first_column
        y = -y * self.per_px - self.first_row
        if not (0.0 <= x < self.columns and 0.0 <= y < self.rows):
            return 0
        row: cython.Py_ssize_t = int(y)
        column: cython.Py_ssize_t = int(x)
        return self.cell[row, column]

    def contains_with_margin(self, x, y, margin):
        """Return whether the places so far to all four sides lie in the print area."""
        return (
            self.contains(x - margin, y)
            and self.contains(x + margin, y)
            and self.contains(x, y - margin)
            and self.contains(x, y + margin)
        )
