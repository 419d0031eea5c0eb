# mypy: ignore-errors
"""Kernel: a prepared print as the other kernels see it, and how it is unpacked from few bytes.

Minutiae, neighbourhoods and regions are as `fpmatch.matching.prints.prepare` and
`fpmatch.matching.prints.neighbourhood` have them.
"""

import cython
import numpy as np
from cython.cimports.libc.math import sqrt


@cython.final
@cython.cclass
class TemplateView:
    """A prepared print: its minutiae, neighbourhoods, bit descriptors, and the cells of its area.

    The arrays may be larger than what they hold: `size` is the number of minutiae. The area's
    codes, and its ridge images if it has any, begin at entry `cell_at`, row by row.
    """

    def __init__(self, points, quality, count, frame) -> None:
        self.size = points.shape[1]
        self.first = self.cell_at = self.rows = self.columns = 0
        self.first_row = self.first_column = self.inside = 0
        self.step = self.per_px = 1.0
        self.has_flow = self.has_ridges = False
        self.points, self.quality = memoryview(points), memoryview(quality)
        self.count, self.frame = memoryview(count), memoryview(frame)
        self.xy = memoryview(np.empty((0, 2), np.float32))
        self.direction_bin = memoryview(np.empty(0, np.uint8))
        self.neighbour_bits = memoryview(np.empty((0, 0), np.uint16))
        self.orientation_bins = memoryview(np.empty((0, 0), np.uint8))
        self.cell = memoryview(np.empty(0, np.uint8))
        self.ridges = memoryview(np.empty(0, np.uint64))

    def set_bit_descriptors(self, xy, direction_bin, neighbour_bits, orientation_bins) -> None:
        """Take the bit descriptors."""
        self.xy = memoryview(xy)
        self.direction_bin = memoryview(direction_bin)
        self.neighbour_bits = memoryview(neighbour_bits)
        self.orientation_bins = memoryview(orientation_bins)

    def set_region(self, code, ridges, first_row, first_column, step, inside, has_flow) -> None:
        """Take the region: `code` (rows, columns) is 0 outside, else encodes the orientation.

        `ridges`, of the same shape, are binary ridge images, or None.
        """
        self.rows, self.columns = code.shape
        self.cell = memoryview(code.ravel())
        self.has_ridges = ridges is not None
        if ridges is not None:
            self.ridges = memoryview(ridges.ravel())
        self.first_row, self.first_column, self.inside = first_row, first_column, inside
        self.step, self.per_px, self.has_flow = step, 1.0 / step, has_flow

    def contains(self, x, y):
        """Return whether a place lies in the print area."""
        x = x * self.per_px - self.first_column
        y = -y * self.per_px - self.first_row
        if not (0.0 <= x < self.columns and 0.0 <= y < self.rows):
            return False
        row: cython.Py_ssize_t = int(y)
        column: cython.Py_ssize_t = int(x)
        return self.cell[self.cell_at + row * self.columns + column] > 0

    def contains_with_margin(self, x, y, margin):
        """Return whether the places so far to all four sides lie in the print area."""
        return (
            self.contains(x - margin, y)
            and self.contains(x + margin, y)
            and self.contains(x, y - margin)
            and self.contains(x, y + margin)
        )


@cython.final
@cython.cclass
class PreparedView:
    """The arrays of an `fpmatch.matching.prints.prepared_prints.PreparedPrints`."""

    def __init__(self, many, quality_of, root_weight_of, tolerance) -> None:
        self.minutiae_start = memoryview(many.minutiae_start)
        self.cell_start = memoryview(many.cell_start)
        self.xy = memoryview(many.xy)
        self.direction = memoryview(many.direction)
        self.quality = memoryview(many.quality)
        self.count = memoryview(many.count)
        self.cell = memoryview(many.cell)
        self.ridges = memoryview(many.ridges)
        self.has_ridges = memoryview(many.has_ridges)
        self.neighbour = memoryview(many.neighbour)
        self.direction_bin = memoryview(many.direction_bin)
        self.neighbour_bits = memoryview(many.neighbour_bits)
        self.orientation_bins = memoryview(many.orientation_bins)
        self.root_weight = memoryview(many.root_weight)
        self.shape = memoryview(many.shape)
        self.step = memoryview(many.step)
        self.has_flow = memoryview(many.has_flow)
        self.inside = memoryview(many.inside)
        self.quality_of = memoryview(quality_of)
        self.root_weight_of = memoryview(root_weight_of)
        self.tolerance, self.tolerance_growth = tolerance

    def attach(self, into):
        """Let a view refer to the descriptors and print areas of all prints."""
        into.xy = self.xy
        into.direction_bin = self.direction_bin
        into.neighbour_bits = self.neighbour_bits
        into.orientation_bins = self.orientation_bins
        into.cell = self.cell
        into.ridges = self.ridges
        return 0

    def open(self, k, into):
        """Let an attached view refer to print k, without minutiae and neighbours."""
        into.first = self.minutiae_start[k]
        into.size = self.minutiae_start[k + 1] - into.first
        into.cell_at = self.cell_start[k]
        into.rows, into.columns = self.shape[k, 0], self.shape[k, 1]
        into.first_row, into.first_column = self.shape[k, 2], self.shape[k, 3]
        into.step = self.step[k]
        into.per_px = 1.0 / into.step
        into.inside = self.inside[k]
        into.has_flow = self.has_flow[k]
        into.has_ridges = self.has_ridges[k]
        return 0

    @cython.locals(m=cython.Py_ssize_t)
    def unpack(self, k, into):
        """Write minutiae and neighbours of print k, which is open, into a view with room for it."""
        first: cython.Py_ssize_t = self.minutiae_start[k]
        for i in range(into.size):
            into.points[0, i] = self.xy[first + i, 0]
            into.points[1, i] = self.xy[first + i, 1]
            into.points[2, i] = self.direction[first + i, 0]
            into.points[3, i] = self.direction[first + i, 1]
            into.quality[i] = self.quality_of[self.quality[first + i]]
            into.count[i] = self.count[first + i]
        for i in range(into.size):
            x, y = into.points[0, i], into.points[1, i]
            c, s = into.points[2, i], into.points[3, i]
            for m in range(into.count[i]):
                j: cython.Py_ssize_t = self.neighbour[first + i, m]
                dx = into.points[0, j] - x
                dy = into.points[1, j] - y
                tolerance = self.tolerance + self.tolerance_growth * sqrt(dx * dx + dy * dy)
                into.frame[i, 0, m] = c * dx + s * dy
                into.frame[i, 1, m] = c * dy - s * dx
                dx = into.points[2, j]
                dy = into.points[3, j]
                into.frame[i, 2, m] = c * dx + s * dy
                into.frame[i, 3, m] = c * dy - s * dx
                into.frame[i, 4, m] = 1.0 / (tolerance * tolerance)
                weight = self.root_weight_of[self.root_weight[first + i, m]]
                into.frame[i, 5, m] = weight
        return 0
