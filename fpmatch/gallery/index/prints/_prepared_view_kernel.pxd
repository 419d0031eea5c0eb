# Types of the kernel. Arrays may be mapped from a file that cannot be written.
from fpmatch.matching.pipeline._kernels._pipeline_kernel cimport Pipeline
from fpmatch.matching.prints._kernels._template_view_kernel cimport TemplateView


cdef class PreparedView:
    cdef readonly Py_ssize_t neighbours
    cdef const long long[::1] minutiae_start, cell_start
    cdef const float[:, ::1] xy, direction
    cdef const unsigned char[::1] quality, count, direction_bin, cell
    cdef const unsigned char[:, ::1] neighbour, root_weight, orientation_bins
    cdef const unsigned short[:, ::1] neighbour_bits
    cdef const int[:, ::1] shape
    cdef const double[::1] step
    cdef const unsigned char[::1] has_flow, has_ridges
    cdef const unsigned long long[::1] ridges
    cdef const int[::1] inside
    cdef const double[::1] quality_of, root_weight_of
    cdef readonly double tolerance, tolerance_growth

    cpdef int attach(self, TemplateView into)
    cpdef int open(self, Py_ssize_t k, TemplateView into) noexcept nogil
    cpdef int unpack(self, Py_ssize_t k, TemplateView into) noexcept nogil
    cpdef int match(
        self, Pipeline pipeline, TemplateView reference, Py_ssize_t first,
        const signed char[::1] order, double[::1] similarity,
    )
