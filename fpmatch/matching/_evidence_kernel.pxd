# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.matching._align_kernel cimport Aligner
from fpmatch.matching._template_view_kernel cimport TemplateView
from fpmatch.matching._ridge_kernel cimport RidgeCorrelator
from fpmatch.matching._ridge_search_kernel cimport RidgeSearch

cdef Py_ssize_t PAIRS, LOCAL, UNPAIRED, COMMON, OVERLAP, RELAXED, PLACES, WEIGHTS
cdef Py_ssize_t FULLNESS, TURNED, STRAIN, FEWEST, RIDGES, CELLS, AREA, CHANCE, ENTRIES
cdef Py_ssize_t MIDDLE, SPREAD, WEIGHT, IMPOSTOR
cdef Py_ssize_t PREFILTER_BASE, PREFILTER_GROWTH, PREFILTER_LIMIT, RELAXATION, REFINE, CONFIDENT, BIAS
cdef Py_ssize_t WITH_RIDGES, MINUTIAE_ALONE, ONE_WITH_RIDGES, SMALL_WITH_RIDGES


cdef class EvidenceScorer:
    cdef readonly double[::1] evidence, feature, term
    cdef double[::1] best, coarse
    cdef const double[:, :, ::1] standard
    cdef const double[:, ::1] limits
    cdef const double[:, :, ::1] quantiles
    cdef int[::1] paired_b
    cdef readonly RidgeCorrelator correlator
    cdef readonly RidgeSearch search
    cdef double small_area
    cdef readonly double total, decade
    cdef double most, last
    cdef int found
    cdef Py_ssize_t model
    cdef double margin, hull_margin, doubt_pairs, doubt_cells, doubt_minutiae, usual_correlation

    cpdef int choose_model(self, bint ridges_a, bint ridges_b, double area) noexcept nogil
    @cython.locals(enough=cython.double)
    cpdef double prefilter_shortfall(self, int weight, Py_ssize_t smaller) noexcept nogil
    cpdef double prefilter_rejected(self, double shortfall) noexcept nogil
    @cython.locals(total=cython.double)
    cpdef double score_alignment(
        self, TemplateView a, TemplateView b, Aligner aligner, float[:, ::1] similarity
    ) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, hypotheses=cython.Py_ssize_t, first=cython.Py_ssize_t,
        count=cython.Py_ssize_t, refine=cython.double, confident=cython.double, weak=cython.bint,
        ridges=cython.bint,
    )
    cpdef double align(
        self, TemplateView a, TemplateView b, Aligner aligner, float[:, ::1] similarity
    ) noexcept nogil
    @cython.locals(e=cython.Py_ssize_t, total=cython.double, better=cython.bint)
    cdef bint _save_better(
        self, TemplateView a, TemplateView b, Aligner aligner, float[:, ::1] similarity, bint ridges
    ) noexcept nogil
    @cython.locals(c=cython.double, s=cython.double, x=cython.double, y=cython.double)
    cdef double _compare_ridges(self, TemplateView a, TemplateView b, Aligner aligner) noexcept nogil
    @cython.locals(pairs=cython.double, per_pair=cython.double, k=cython.Py_ssize_t)
    cpdef int describe(self) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, low=cython.double, high=cython.double, limit=cython.double,
        minutiae=cython.double, ridges=cython.double, cells=cython.double,
    )
    cpdef double condition(self, double total) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, m=cython.Py_ssize_t, apart=cython.double, total=cython.double,
    )
    cdef double _total(self) noexcept nogil
    @cython.locals(
        i=cython.Py_ssize_t, j=cython.Py_ssize_t, pairs=cython.double, common=cython.double,
        common_b=cython.double, local=cython.double, unpaired=cython.double,
        unpaired_b=cython.double, squares=cython.double, squares_b=cython.double, px=cython.double,
        py=cython.double, qx=cython.double, qy=cython.double, area=cython.double,
        smaller=cython.double, c=cython.double, s=cython.double, x=cython.double, y=cython.double,
        scale=cython.double, margin_a=cython.double, margin_b=cython.double,
        partner=cython.int[::1], predicted=cython.double[:, ::1],
    )
    cdef int _gather(
        self, TemplateView a, TemplateView b, Aligner aligner, float[:, ::1] similarity
    ) noexcept nogil
