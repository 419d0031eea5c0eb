# mypy: ignore-errors
"""Kernel: compare a probe with references, one after the other.

Each comparison takes the same steps: the prefilter; the local similarity of all minutiae; alignment
by its hypotheses, scored by the evidence. `fit_pairs` fits the transform of the pairs in pixels of
the two images.
"""

import cython
import numpy as np
from cython.cimports.libc.math import atan2, cos, sin, sqrt

if cython.compiled:
    from cython.cimports.fpmatch.matching._amount_kernel import as_similarity, smaller_area
    from cython.cimports.fpmatch.matching._local_kernel import normalize_by_size
else:
    from fpmatch.matching.pipeline._kernels._amount_kernel import as_similarity, smaller_area
    from fpmatch.matching.pipeline._kernels._local_kernel import normalize_by_size


@cython.final
@cython.cclass
class Comparer:
    """Compare a probe with one reference after the other, each of up to `capacity` minutiae.

    `before` and `after` are the aligners in which a reference is print A or print B: the prints
    are taken in the order of their content, so that exchanging them changes nothing. `neighbours`,
    the index of the probe's, is set before it is aligned. `parameters` are an
    `fpmatch.matching.pipeline.local.LocalParameters`.
    """

    def __init__(self, capacity, prefilter, before, after, scorer, parameters) -> None:
        self.prefilter, self.scorer = prefilter, scorer
        self.before, self.after = before, after
        self.similarity = memoryview(np.empty((capacity, capacity), np.float32))
        self.probe = self.neighbours = None
        self.before_loaded = self.after_loaded = False
        self.min_cosine = parameters.min_cosine
        self.fewest_neighbours = parameters.fewest_neighbours

    def load(self, probe):
        """Take a probe in place of the last one."""
        self.probe = probe
        p = probe
        self.prefilter.load(p.xy, p.direction_bin, p.neighbour_bits, p.orientation_bins, p.has_flow)
        self.before_loaded = self.after_loaded = False
        return 0

    def shortfall(self, reference, reference_first):
        """Return by how much the prefilter's score falls short of its threshold."""
        self.scorer.choose_model(
            self.probe.has_ridges, reference.has_ridges, smaller_area(self.probe, reference)
        )
        return self.scorer.prefilter_shortfall(
            self.prefilter.score(
                reference.first,
                reference.first + reference.size,
                reference.xy,
                reference.direction_bin,
                reference.neighbour_bits,
                reference.orientation_bins,
                reference.has_flow,
                reference_first,
            ),
            min(self.probe.size, reference.size),
        )

    def align(self, reference, reference_first):
        """Align the probe with a reference; return an estimate of -ln(FMR).

        Where nothing is paired, the aligner's `best_pairs` are 0, and so is the result.
        """
        if reference_first:
            self.neighbours.to_prints_before(
                reference.count, reference.frame, reference.size, self.min_cosine, self.similarity
            )
            self._normalize(reference, self.probe)
            if not self.before_loaded:
                self.before.load_b(self.probe.points, self.probe.size)
                self.before_loaded = True
            self.before.load_a(reference.points, reference.size)
            return self.scorer.align(reference, self.probe, self.before, self.similarity)
        self.neighbours.to_prints_after(
            reference.count, reference.frame, reference.size, self.min_cosine, self.similarity
        )
        self._normalize(self.probe, reference)
        if not self.after_loaded:
            self.after.load_a(self.probe.points, self.probe.size)
            self.after_loaded = True
        self.after.load_b(reference.points, reference.size)
        return self.scorer.align(self.probe, reference, self.after, self.similarity)

    def _normalize(self, a, b):
        return normalize_by_size(
            self.similarity, a.count, a.size, b.count, b.size, self.fewest_neighbours
        )

    def compare_packed(self, packed, reference, first, order, similarity):
        """Fill the similarities of the probe to the packed prints from number `first` on.

        Where ``order[k]`` is negative the print comes before the probe, where it is positive
        after; where it is 0, the similarity is not touched. `reference` has room for any of them.
        """
        packed.attach(reference)
        with cython.nogil:
            for k in range(order.shape[0]):
                if order[k] != 0:
                    packed.open(first + k, reference)
                    similarity[k] = 0.0
                    if reference.size > 0 and self.probe.size > 0:
                        shortfall = self.shortfall(reference, order[k] < 0)
                        if shortfall > 0.0:
                            shortfall = self.scorer.prefilter_rejected(shortfall)
                            similarity[k] = as_similarity(shortfall)
                        else:
                            packed.unpack(first + k, reference)
                            similarity[k] = self._similarity(reference, order[k] < 0)
        return 0

    def _similarity(self, reference, reference_first):
        """Return the similarity of the probe to a reference that has passed the prefilter."""
        total = self.align(reference, reference_first)
        pairs = self.before.best_pairs if reference_first else self.after.best_pairs
        return as_similarity(total) if pairs > 0 else 0.0


@cython.locals(i=cython.Py_ssize_t)
def fit_pairs(
    a,
    b,
    to_500dpi_a,
    to_500dpi_b,
    index_a,
    index_b,
    partner,
    weight,
    turn,
    fewest,
    most_stretch,
    swapped,
    pairs,
    fitted,
):
    """Fit the transform of the pairs in pixels, y pointing down; return the number of pairs.

    `a` and `b` are the minutiae (4, N) of two prints at 500 dpi, to which their pixels are scaled
    by `to_500dpi_a` and `to_500dpi_b`; `index_a` and `index_b` are their numbers in the templates.
    ``partner[i]`` is the minutia of B that minutia i of A is paired with, or -1. The least-squares
    transform of the weighted pairs is taken if there are `fewest` at least and its scale is that of
    the resolutions up to a factor of `most_stretch`; else that scale and the rotation `turn` are.
    ``fitted[:4]`` become scale, rotation and shift, ``fitted[4]`` the root of the mean square
    distance; from B to A where `swapped`, and `pairs` are sorted accordingly.
    """
    n: cython.int = 0
    mass = pmx = pmy = qmx = qmy = 0.0
    cosine = sine = spread = total = 0.0
    scale = to_500dpi_a / to_500dpi_b
    for i in range(a.shape[1]):
        j: cython.Py_ssize_t = partner[i]
        if j < 0:
            continue
        w = weight[i]
        mass += w
        pmx += w * (a[0, i] / to_500dpi_a)
        pmy -= w * (a[1, i] / to_500dpi_a)
        qmx += w * (b[0, j] / to_500dpi_b)
        qmy -= w * (b[1, j] / to_500dpi_b)
        if swapped:
            k = n
            while k > 0 and pairs[k - 1, 0] > index_b[j]:
                pairs[k, 0], pairs[k, 1] = pairs[k - 1, 0], pairs[k - 1, 1]
                k -= 1
            pairs[k, 0], pairs[k, 1] = index_b[j], index_a[i]
        else:
            pairs[n, 0], pairs[n, 1] = index_a[i], index_b[j]
        n += 1
    pmx /= mass
    pmy /= mass
    qmx /= mass
    qmy /= mass
    if n >= fewest:
        for i in range(a.shape[1]):
            j = partner[i]
            if j < 0:
                continue
            w = weight[i]
            px = a[0, i] / to_500dpi_a - pmx
            py = -a[1, i] / to_500dpi_a - pmy
            qx = b[0, j] / to_500dpi_b - qmx
            qy = -b[1, j] / to_500dpi_b - qmy
            cosine += w * (px * qx + py * qy)
            sine += w * (px * qy - py * qx)
            spread += w * (px * px + py * py)
        free = sqrt(cosine * cosine + sine * sine)
        free = free / spread if spread > 0.0 and free > 0.0 else 1.0
        if 1.0 / most_stretch <= free / scale <= most_stretch:
            turn = atan2(sine, cosine)
            scale = free
    cosine = scale * cos(turn)
    sine = scale * sin(turn)
    px = qmx - cosine * pmx + sine * pmy
    py = qmy - sine * pmx - cosine * pmy
    fitted[0], fitted[1], fitted[2], fitted[3] = scale, turn, px, py
    for i in range(a.shape[1]):
        j = partner[i]
        if j < 0:
            continue
        qx = cosine * a[0, i] / to_500dpi_a + sine * a[1, i] / to_500dpi_a
        qy = sine * a[0, i] / to_500dpi_a - cosine * a[1, i] / to_500dpi_a
        qx = qx + px - b[0, j] / to_500dpi_b
        qy = qy + py + b[1, j] / to_500dpi_b
        total += qx * qx + qy * qy
    fitted[4] = sqrt(total / n)
    if swapped:
        fitted[0] = 1.0 / scale
        fitted[1] = -turn
        cosine /= scale * scale
        sine /= scale * scale
        fitted[2] = -cosine * px - sine * py
        fitted[3] = sine * px - cosine * py
        fitted[4] /= scale
    return n
