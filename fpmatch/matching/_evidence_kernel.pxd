# What other kernels may use of this one.
from fpmatch.matching._align_kernel cimport Aligner
from fpmatch.matching._template_view_kernel cimport Print
from fpmatch.matching._ridge_kernel cimport RidgeCorrelator
from fpmatch.matching._ridge_search_kernel cimport RidgeSearch


cdef class EvidenceScorer:
    cdef readonly double[::1] evidence, feature, term
    cdef double[::1] best, coarse
    cdef const double[:, :, ::1] standard
    cdef const double[:, ::1] limits
    cdef const double[:, :, ::1] quantiles
    cdef int[::1] paired_b
    cdef readonly RidgeCorrelator lens
    cdef readonly RidgeSearch search
    cdef double small_area
    cdef readonly double total, decade
    cdef double most, last
    cdef int found
    cdef Py_ssize_t model
    cdef double margin, hull_margin, doubt_pairs, doubt_cells, doubt_minutiae, usual_correlation

    cpdef int choose_model(self, bint ridges_a, bint ridges_b, double area) noexcept nogil
    cpdef double prefilter_shortfall(self, int weight, Py_ssize_t smaller) noexcept nogil
    cpdef double prefilter_rejected(self, double shortfall) noexcept nogil
    cpdef double score_alignment(
        self, Print a, Print b, Aligner aligner, float[:, ::1] similarity
    ) noexcept nogil
    cpdef double align(
        self, Print a, Print b, Aligner aligner, float[:, ::1] similarity
    ) noexcept nogil
    cdef bint _save_better(
        self, Print a, Print b, Aligner aligner, float[:, ::1] similarity, bint ridges
    ) noexcept nogil
    cdef double _compare_ridges(self, Print a, Print b, Aligner aligner) noexcept nogil
    cpdef int describe(self) noexcept nogil
    cpdef double condition(self, double total) noexcept nogil
    cdef double _most_decades(self) noexcept nogil
    cdef double _total(self) noexcept nogil
    cdef int _gather(
        self, Print a, Print b, Aligner aligner, float[:, ::1] similarity
    ) noexcept nogil


cpdef double smaller_area(Print a, Print b) noexcept nogil
cdef double common_cells(Print a, Print b, double c, double s, double x, double y) noexcept nogil
cpdef int describe_amount(double minutiae, double area, double[::1] term) noexcept nogil
cdef double poisson_decades(double count, double mean) noexcept nogil
cdef double raised(double squares, double minutiae) noexcept nogil
cdef double saturated(double amount, double enough) noexcept nogil
cpdef double as_similarity(double total) noexcept nogil
