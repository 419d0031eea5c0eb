# Types of the kernel, and what other kernels may use of it.
from fpmatch.matching.pipeline._kernels._alignment_kernel cimport Aligner
from fpmatch.matching.prints._kernels._template_view_kernel cimport TemplateView
from fpmatch.matching.pipeline._kernels._ridge_kernel cimport RidgeCorrelator

cdef Py_ssize_t PAIRS, LOCAL, UNPAIRED, COMMON, OVERLAP, RELAXED, PLACES, WEIGHTS
cdef Py_ssize_t FULLNESS, FEWEST, RIDGES, CELLS, AREA, CHANCE, ENTRIES
cdef Py_ssize_t MIDDLE, SPREAD, WEIGHT, IMPOSTOR
cdef Py_ssize_t PREFILTER_BASE, PREFILTER_GROWTH, PREFILTER_LIMIT, RELAXATION, REFINE, CONFIDENT, BIAS
cdef Py_ssize_t WITH_RIDGES, MINUTIAE_ALONE, SMALL_WITH_RIDGES


cdef class EvidenceScorer:
    cdef readonly double[::1] evidence, feature, term
    cdef const double[:, :, ::1] standard
    cdef const double[:, ::1] limits, flow
    cdef const double[:, :, ::1] quantiles
    cdef int[::1] paired_b
    cdef readonly RidgeCorrelator correlator
    cdef readonly double total
    cdef Py_ssize_t model
    cdef double margin, hull_margin, doubt_pairs, doubt_cells, doubt_minutiae, usual_correlation
    cdef double beyond_from, beyond_less, beyond_few, beyond_share

    cpdef int choose_model(self, bint ridges_a, bint ridges_b, double area) noexcept nogil
    cpdef double prefilter_shortfall(self, int weight, Py_ssize_t smaller) noexcept nogil
    cpdef double prefilter_rejected(self, double shortfall) noexcept nogil
    cpdef double score_alignment(
        self, TemplateView a, TemplateView b, Aligner aligner, float[:, ::1] similarity
    ) noexcept nogil
    cdef double refine_threshold(self) noexcept nogil
    cdef double confident_threshold(self) noexcept nogil
    cdef double relaxation_threshold(self) noexcept nogil
    cdef bint is_small(self) noexcept nogil
    cpdef double weigh(
        self, TemplateView a, TemplateView b, Aligner aligner, float[:, ::1] similarity, bint ridges
    ) noexcept nogil
    cdef double score(self, double[:, ::1] evidence, Py_ssize_t row) noexcept nogil
    cdef double _compare_ridges(self, TemplateView a, TemplateView b, Aligner aligner) noexcept nogil
    cpdef int describe(self) noexcept nogil
    cpdef double condition(self, double total) noexcept nogil
    cpdef double beyond_chance(
        self, TemplateView a_print, TemplateView b_print, Aligner aligner, Py_ssize_t row,
        double estimate
    ) noexcept nogil
    cdef double _total(self) noexcept nogil
    cdef int _gather(
        self, TemplateView a, TemplateView b, Aligner aligner, float[:, ::1] similarity
    ) noexcept nogil
