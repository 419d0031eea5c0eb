# Types of the kernel.
from fpmatch.matching._align_kernel cimport Aligner
from fpmatch.matching.prints._prefilter_kernel cimport Prefilter
from fpmatch.matching._evidence_kernel cimport EvidenceScorer
from fpmatch.matching._local_kernel cimport NeighbourIndex
from fpmatch.matching.prints._template_view_kernel cimport PreparedView, TemplateView


cdef class Comparer:
    cdef readonly Prefilter prefilter
    cdef readonly Aligner before, after
    cdef readonly EvidenceScorer scorer
    cdef readonly float[:, ::1] similarity
    cdef TemplateView probe
    cdef public NeighbourIndex neighbours
    cdef bint before_loaded, after_loaded
    cdef double min_cosine
    cdef int fewest_neighbours

    cpdef int load(self, TemplateView probe)
    cpdef double shortfall(self, TemplateView reference, bint reference_first) noexcept nogil
    cpdef double align(self, TemplateView reference, bint reference_first) noexcept nogil
    cdef int _normalize(self, TemplateView a, TemplateView b) noexcept nogil
    cpdef int compare_packed(
        self, PreparedView packed, TemplateView reference, Py_ssize_t first,
        const signed char[::1] order, double[::1] similarity,
    )
    cdef double _similarity(self, TemplateView reference, bint reference_first) noexcept nogil


cpdef int fit_pairs(
    double[:, ::1] a, double[:, ::1] b, double to_500dpi_a, double to_500dpi_b,
    const int[::1] index_a, const int[::1] index_b, int[::1] partner, double[::1] weight,
    double turn, int fewest, double most_stretch, bint swapped, int[:, ::1] pairs,
    double[::1] fitted,
)
