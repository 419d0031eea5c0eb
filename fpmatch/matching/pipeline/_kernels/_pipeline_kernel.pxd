# Types of the kernel.
from fpmatch.matching.pipeline._kernels._alignment_kernel cimport Aligner
from fpmatch.matching.pipeline._kernels._evidence_kernel cimport EvidenceScorer
from fpmatch.matching.pipeline._kernels._local_kernel cimport NeighbourIndex
from fpmatch.matching.pipeline._kernels._ridge_search_kernel cimport RidgeSearch
from fpmatch.matching.prints._kernels._prefilter_kernel cimport Prefilter
from fpmatch.matching.prints._kernels._template_view_kernel cimport TemplateView

# of `matching.constants`
cdef double REJECTED, SHORTFALL


cdef class Pipeline:
    cdef readonly Py_ssize_t capacity, best
    cdef readonly object parameters, weights, kept
    cdef readonly Prefilter prefilter
    cdef readonly Aligner aligner
    cdef readonly EvidenceScorer scorer
    cdef readonly RidgeSearch search
    cdef readonly float[:, ::1] similarity
    cdef readonly double[::1] total
    cdef readonly TemplateView probe
    cdef public NeighbourIndex neighbours

    cpdef int load(self, TemplateView probe)
    cpdef double rejected(self, TemplateView reference, bint reference_first) noexcept nogil
    cpdef double match(self, TemplateView reference, bint reference_first) noexcept nogil
    cdef double _match(self, TemplateView a, TemplateView b) noexcept nogil
    cdef Py_ssize_t _pair_and_grow(self, TemplateView a, TemplateView b) noexcept nogil
    cdef Py_ssize_t _grow_to_the_end(
        self, TemplateView a, TemplateView b, Py_ssize_t best
    ) noexcept nogil
    cdef Py_ssize_t _search_by_ridges(
        self, TemplateView a, TemplateView b, Py_ssize_t best
    ) noexcept nogil
    cdef Py_ssize_t _weigh(
        self, TemplateView a, TemplateView b, Py_ssize_t h, bint ridges, Py_ssize_t best
    ) noexcept nogil
    cdef bint _is_confident(self, Py_ssize_t h) noexcept nogil
