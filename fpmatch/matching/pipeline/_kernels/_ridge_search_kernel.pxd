# Types of the kernel, and what other kernels may use of it.
from fpmatch.matching.pipeline._kernels._relaxation_kernel cimport Relaxation
from fpmatch.matching.pipeline._kernels._ridge_kernel cimport RidgeCorrelator
from fpmatch.matching.prints._kernels._template_view_kernel cimport TemplateView


cdef class RidgeSearch:
    cdef readonly int[::1] first, second
    cdef const double[::1] flow_c, flow_s
    cdef double[:, ::1] sample, sample_flow, transform
    cdef double[::1] best_flow, value
    cdef int[::1] best_own, best_other
    cdef Py_ssize_t samples, count, room, most
    cdef Py_ssize_t ridge_trials, ridge_starts, ridge_candidates
    cdef double middle_x, middle_y, c, s, x, y
    cdef double min_flow, min_value
    cdef double least_common, least_flow, usual_correlation, apart_px, apart_cosine
    cdef double candidate_flow, candidate_value

    cpdef int search(
        self, TemplateView a, TemplateView b, Relaxation relaxation, bint every,
        RidgeCorrelator correlator,
    ) noexcept nogil
    cdef int _search(
        self, TemplateView small, int[::1] own, TemplateView large, int[::1] other,
        Py_ssize_t candidates, bint every, RidgeCorrelator correlator,
    ) noexcept nogil
    cdef int _take_samples(self, TemplateView small) noexcept nogil
    cdef int _fit_pair(self, TemplateView small, Py_ssize_t i, TemplateView large, Py_ssize_t j) noexcept nogil
    cdef double _flow_agreement(self, TemplateView large) noexcept nogil
    cdef int _offer(self, TemplateView small, int i, TemplateView large, int j) noexcept nogil
    cdef int _choose(self) noexcept nogil
    cdef bint _is_near(self, Py_ssize_t k) noexcept nogil
