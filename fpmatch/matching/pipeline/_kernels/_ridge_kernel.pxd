# Types of the kernel, and what other kernels may use of it.
from fpmatch.matching.pipeline._kernels._pair_mesh_kernel cimport PairMesh
from fpmatch.matching.prints._kernels._template_view_kernel cimport TemplateView

# of `matching.constants`
cdef Py_ssize_t FRAME
cdef int BITS_ALONG, REACH, SHIFTS, FEWEST_AROUND, MOST_CELLS
cdef double SMALL_AREA_PX2


cdef class RidgeCorrelator:
    cdef readonly double correlation
    cdef readonly int cells
    cdef const unsigned long long[::1] spread
    cdef const int[::1] sample
    cdef double[:, ::1] offset, drift, vertex
    cdef Py_ssize_t blocks, samples
    cdef unsigned long long[::1] ridge_image
    cdef unsigned long long[:, ::1] agreeing, wide
    cdef unsigned char[::1] both
    cdef double c, s, x, y

    cpdef int compare(
        self, TemplateView a, TemplateView b, PairMesh mesh, double c, double s, double x, double y
    ) noexcept nogil
    cdef bint _take(
        self, TemplateView a, TemplateView b, double c, double s, double x, double y
    ) noexcept nogil
    cdef int _correlate(self, TemplateView a, TemplateView b) noexcept nogil
    cdef int _displace(self, TemplateView a, PairMesh mesh) noexcept nogil
    cdef double _mapped(
        self, Py_ssize_t axis, Py_ssize_t p, Py_ssize_t q, Py_ssize_t r, double at_q, double at_r
    ) noexcept nogil
    cdef int _within(self, double line, int lines) noexcept nogil
    cdef int _count(
        self, TemplateView b, Py_ssize_t own, unsigned long long ridges, double x, double y
    ) noexcept nogil
    cdef double _best_shift(self, Py_ssize_t own, Py_ssize_t wide) noexcept nogil


cdef double smaller_area(TemplateView a, TemplateView b) noexcept nogil
