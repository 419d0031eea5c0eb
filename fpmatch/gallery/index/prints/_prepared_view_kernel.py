# mypy: ignore-errors
"""Kernel: prepared prints in flat arrays, unpacked one after the other to be matched with a probe.

The arrays are described in `fpmatch.gallery.index.prints.prepared_prints`.
"""

import cython
from cython.cimports.libc.math import sqrt

if cython.compiled:
    from cython.cimports.fpmatch.matching.pipeline._kernels._evidence_kernel import as_similarity
else:
    from fpmatch.matching.pipeline.evidence import as_similarity


@cython.final
@cython.cclass
class PreparedView:
    """The arrays of a `PreparedPrints`."""

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

    def match(self, pipeline, reference, first, order, similarity):
        """Fill the similarities of the probe of a pipeline to the prints from number `first` on.

        Where ``order[k]`` is negative the print comes before the probe, where it is positive
        after; where it is 0, the similarity is not touched. `reference` has room for any of them.
        """
        self.attach(reference)
        with cython.nogil:
            for k in range(order.shape[0]):
                if order[k] != 0:
                    self.open(first + k, reference)
                    similarity[k] = 0.0
                    if reference.size > 0 and pipeline.probe.size > 0:
                        estimate = pipeline.rejected(reference, order[k] < 0)
                        if not estimate < 0.0:
                            self.unpack(first + k, reference)
                            estimate = pipeline.match(reference, order[k] < 0)
                            if pipeline.best < 0:
                                continue
                        similarity[k] = as_similarity(estimate)
        return 0
