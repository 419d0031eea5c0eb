"""Kernel: compare two prints, and fit the transform of their pairs in pixels of the two images.

It takes the steps of `_one_to_many_kernel`, which keeps nothing but the similarity. Interpreted,
the class and the function run as they stand.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.fpmatch.matching._align_kernel import Aligner
    from cython.cimports.fpmatch.matching._bit_descriptor_kernel import Prefilter
    from cython.cimports.fpmatch.matching._evidence_kernel import EvidenceScorer, smaller_area
    from cython.cimports.fpmatch.matching._local_kernel import NeighbourIndex, normalize_by_size
    from cython.cimports.fpmatch.matching._template_view_kernel import TemplateView
    from cython.cimports.libc.math import atan2, cos, sin, sqrt
else:
    from math import atan2, cos, sin, sqrt

    from fpmatch.matching._align_kernel import Aligner
    from fpmatch.matching._bit_descriptor_kernel import Prefilter
    from fpmatch.matching._evidence_kernel import EvidenceScorer, smaller_area
    from fpmatch.matching._local_kernel import NeighbourIndex, normalize_by_size
    from fpmatch.matching._template_view_kernel import TemplateView

COMPILED = cython.compiled


@cython.final
@cython.cclass
class OneToOne:
    """Reusable workspace in which prints of up to so many minutiae are compared, two at a time.

    `local` is an `fpmatch.matching.local.LocalParameters`.
    """

    prefilter: Prefilter
    sieved: object
    aligner: Aligner
    scorer: EvidenceScorer
    similarity: cython.float[:, ::1]
    min_cosine: cython.double
    fewest_neighbours: cython.int

    def __init__(self, prefilter, aligner, scorer, room, local) -> None:
        self.prefilter = prefilter
        self.sieved = None
        self.aligner = aligner
        self.scorer = scorer
        self.similarity = np.empty((room, room), np.float32)
        self.min_cosine = local.min_cosine
        self.fewest_neighbours = local.fewest_neighbours

    @cython.ccall
    def prefilter_shortfall(
        self, own: TemplateView, other: TemplateView, other_first: cython.bint
    ) -> cython.double:
        """Return by how much the prefilter's score of two prints falls short of its threshold.

        The own print stays in the tables, for the next to be compared with. `other_first` states
        which of the two is print A.
        """
        weight: cython.int
        if self.sieved is not own:
            self.prefilter.load(
                own.xy, own.direction_bin, own.neighbour_bits, own.orientation_bins, own.has_flow
            )
            self.sieved = own
        weight = self.prefilter.score(
            0,
            other.size,
            other.xy,
            other.direction_bin,
            other.neighbour_bits,
            other.orientation_bins,
            other.has_flow,
            other_first,
        )
        self.scorer.choose_model(own.has_ridges, other.has_ridges, smaller_area(own, other))
        return self.scorer.prefilter_shortfall(
            weight, own.size if own.size < other.size else other.size
        )

    @cython.ccall
    def align(self, neighbours: NeighbourIndex, a: TemplateView, b: TemplateView) -> cython.double:
        """Align A, whose neighbours are indexed, with B; return an estimate of -ln(FMR).

        Where nothing is paired, the aligner's `best_pairs` are 0, and so is the result.
        """
        neighbours.to_prints_after(b.count, b.frame, b.size, self.min_cosine, self.similarity)
        normalize_by_size(self.similarity, a.count, a.size, b.count, b.size, self.fewest_neighbours)
        self.aligner.put_a(a.points, a.size)
        self.aligner.put_b(b.points, b.size)
        return self.scorer.align(a, b, self.aligner, self.similarity)


@cython.ccall
def fit_pairs(
    a: cython.double[:, ::1],
    b: cython.double[:, ::1],
    to_500dpi_a: cython.double,
    to_500dpi_b: cython.double,
    index_a: cython.const[cython.int][::1],
    index_b: cython.const[cython.int][::1],
    partner: cython.int[::1],
    weight: cython.double[::1],
    turn: cython.double,
    fewest: cython.int,
    most_stretch: cython.double,
    swapped: cython.bint,
    pairs: cython.int[:, ::1],
    fitted: cython.double[::1],
) -> cython.int:
    """Fit the transform of the pairs in pixels, y pointing down; return the number of pairs.

    `a` and `b` are the minutiae (4, N) of two prints, at so many pixels at 500 dpi a pixel, and
    `index_a` and `index_b` their numbers. ``partner[i]`` is what minutia i of A is paired with, or
    -1. The least-squares transform of the weighted pairs is taken where there are `fewest` at least
    and its scale is that of the resolutions but for a factor of `most_stretch`; else that scale and
    the rotation `turn` stand. To ``fitted[:4]`` go scale, rotation and shift, to ``fitted[4]`` the
    root of the mean square distance; from B to A where `swapped`. `pairs` are then sorted so, too.
    """
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    k: cython.Py_ssize_t
    n: cython.int = 0
    w: cython.double
    mass: cython.double = 0.0
    pmx: cython.double = 0.0
    pmy: cython.double = 0.0
    qmx: cython.double = 0.0
    qmy: cython.double = 0.0
    px: cython.double
    py: cython.double
    qx: cython.double
    qy: cython.double
    cosine: cython.double = 0.0
    sine: cython.double = 0.0
    spread: cython.double = 0.0
    scale: cython.double = to_500dpi_a / to_500dpi_b
    free: cython.double
    total: cython.double = 0.0
    for i in range(a.shape[1]):
        j = partner[i]
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
                pairs[k, 0] = pairs[k - 1, 0]
                pairs[k, 1] = pairs[k - 1, 1]
                k -= 1
            pairs[k, 0] = index_b[j]
            pairs[k, 1] = index_a[i]
        else:
            pairs[n, 0] = index_a[i]
            pairs[n, 1] = index_b[j]
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
    fitted[0] = scale
    fitted[1] = turn
    fitted[2] = px
    fitted[3] = py
    for i in range(a.shape[1]):
        j = partner[i]
        if j < 0:
            continue
        qx = (
            cosine * a[0, i] / to_500dpi_a
            + sine * a[1, i] / to_500dpi_a
            + px
            - b[0, j] / to_500dpi_b
        )
        qy = (
            sine * a[0, i] / to_500dpi_a
            - cosine * a[1, i] / to_500dpi_a
            + py
            + b[1, j] / to_500dpi_b
        )
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
