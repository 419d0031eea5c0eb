# Types of the kernel.
from fpmatch.matching.pipeline._kernels._alignment_kernel cimport Aligner
from fpmatch.matching.prints._kernels._prefilter_kernel cimport Prefilter
from fpmatch.matching.pipeline._kernels._evidence_kernel cimport EvidenceScorer
from fpmatch.matching.pipeline._kernels._local_kernel cimport NeighbourIndex
from fpmatch.matching.pipeline._kernels._ridge_search_kernel cimport RidgeSearch
from fpmatch.matching.prints._kernels._template_view_kernel cimport TemplateView


cdef class Pipeline:
    cdef readonly Prefilter prefilter
    cdef readonly Aligner aligner
    cdef readonly EvidenceScorer scorer
    cdef readonly RidgeSearch search
    cdef readonly float[:, ::1] similarity
    cdef readonly double[::1] total
    cdef readonly double[:, ::1] evidence
    cdef readonly Py_ssize_t best
    cdef TemplateView probe
    cdef public NeighbourIndex neighbours
    cdef double min_cosine
    cdef int fewest_neighbours

    cpdef int load(self, TemplateView probe)
    cpdef double shortfall(self, TemplateView reference, bint reference_first) noexcept nogil
    cpdef double match_with(self, TemplateView reference, bint reference_first) noexcept nogil
    cdef double match(self, TemplateView a, TemplateView b, bint reference_first) noexcept nogil
    cdef int _match_locally(
        self, TemplateView a, TemplateView b, bint reference_first
    ) noexcept nogil
    cdef Py_ssize_t _pair_and_grow(self, TemplateView a, TemplateView b) noexcept nogil
    cdef Py_ssize_t _grow_to_the_end(
        self, TemplateView a, TemplateView b, Py_ssize_t best
    ) noexcept nogil
    cdef Py_ssize_t _search_by_ridges(
        self, TemplateView a, TemplateView b, Py_ssize_t best
    ) noexcept nogil
    cdef int _weigh(
        self, TemplateView a, TemplateView b, Py_ssize_t h, bint ridges
    ) noexcept nogil
    cdef Py_ssize_t _better(self, Py_ssize_t best, Py_ssize_t h) noexcept nogil
    cdef bint _is_confident(self, Py_ssize_t h) noexcept nogil


cpdef int fit_pairs(
    double[:, ::1] a, double[:, ::1] b, double to_500dpi_a, double to_500dpi_b,
    const int[::1] index_a, const int[::1] index_b, int[::1] partner, double[::1] weight,
    double turn, int fewest, double most_stretch, bint swapped, int[:, ::1] pairs,
    double[::1] fitted,
)
