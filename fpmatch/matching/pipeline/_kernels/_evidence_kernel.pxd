# Types of the kernel, and what other kernels may use of it.
from fpmatch.matching.pipeline._kernels._alignment_kernel cimport Aligner
from fpmatch.matching.pipeline._kernels._ridge_kernel cimport RidgeCorrelator
from fpmatch.matching.prints._kernels._template_view_kernel cimport TemplateView

# of `matching.constants`
cdef double LOG_10, SMALL_AREA_PX2, LEAST_RELAXED, LEAST_SPREAD, LEAST_MEAN_SQUARE
cdef double ENOUGH_MINUTIAE, ENOUGH_AREA, LEAST_AREA, UNIT_AREA, DECADES_PER_PAIR
cdef double FULL_AGREEMENT, CELLS_PER_DECADE, AROUND2, BESIDE2, LEAST_COSINE, PER_AROUND
cdef double PLACE2, TURN2, DENSER_PLACE, DENSER_TURN, FAR_SHARE, LEAST_BY_CHANCE, ALIGNED
cdef double FULLY_ALIGNED, FULL_CELLS, FEW_TO_HOLD, ENOUGH_TO_HOLD
cdef Py_ssize_t PAIRS, LOCAL, UNPAIRED, COMMON, OVERLAP, RELAXED, PLACES, WEIGHTS
cdef Py_ssize_t FULLNESS, FEWEST, RIDGES, CELLS, AREA, ENTRIES
cdef Py_ssize_t MIDDLE, SPREAD, WEIGHT, IMPOSTOR
cdef Py_ssize_t PREFILTER_BASE, PREFILTER_GROWTH, PREFILTER_LIMIT, RELAXATION, REFINE, CONFIDENT, BIAS
cdef Py_ssize_t WITH_RIDGES, MINUTIAE_ALONE, SMALL_WITH_RIDGES


cdef class EvidenceScorer:
    cdef readonly double[::1] evidence, feature, term
    cdef readonly double[:, ::1] kept
    cdef const double[:, :, ::1] standard, quantiles
    cdef const double[:, ::1] limits
    cdef int[::1] paired_b
    cdef readonly RidgeCorrelator correlator
    cdef readonly double total, relaxation, refine, confident
    cdef readonly bint is_small
    cdef Py_ssize_t model
    cdef double margin, doubt_pairs, doubt_cells, doubt_minutiae, usual_correlation
    cdef double beyond_from, beyond_less, beyond_few, beyond_share

    cpdef int choose_model(self, TemplateView a, TemplateView b) noexcept nogil
    cdef double threshold(self, Py_ssize_t smaller) noexcept nogil
    cpdef double weigh(
        self, TemplateView a, TemplateView b, Aligner aligner, float[:, ::1] similarity, bint ridges,
        Py_ssize_t row,
    ) noexcept nogil
    cdef int _gather(
        self, TemplateView a, TemplateView b, Aligner aligner, float[:, ::1] similarity
    ) noexcept nogil
    cdef double _total(self) noexcept nogil
    cpdef double estimate(
        self, TemplateView a, TemplateView b, Aligner aligner, Py_ssize_t row
    ) noexcept nogil
    cdef double _condition(self) noexcept nogil
    cdef double _beyond_chance(
        self, TemplateView a_print, TemplateView b_print, Aligner aligner, Py_ssize_t row,
        double estimate
    ) noexcept nogil


cdef double common_cells(TemplateView a, TemplateView b, double c, double s, double x, double y) noexcept nogil
cdef double poisson_decades(double count, double mean) noexcept nogil
cdef double quality_correction(double squares, double minutiae) noexcept nogil
cdef double saturated(double amount, double enough) noexcept nogil
