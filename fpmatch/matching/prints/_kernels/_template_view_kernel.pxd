# Types of the kernel, and what other kernels may use of it.
cdef class TemplateView:
    cdef readonly Py_ssize_t size
    cdef double[:, ::1] points
    cdef double[::1] quality
    cdef int[::1] count
    cdef float[:, :, ::1] frame
    cdef const float[:, ::1] xy
    cdef const unsigned char[::1] direction_bin
    cdef const unsigned short[:, ::1] neighbour_bits
    cdef const unsigned char[:, ::1] orientation_bins
    cdef const unsigned char[:, ::1] cell
    cdef const unsigned long long[:, ::1] ridges
    cdef int rows, columns, first_row, first_column, inside
    cdef double step, per_px
    cdef bint has_flow, has_ridges

    cpdef bint lies_off_ridges(self) noexcept nogil
    cdef int code_at(self, double x, double y) noexcept nogil
    cdef bint contains(self, double x, double y) noexcept nogil
    cdef bint contains_with_margin(self, double x, double y, double margin) noexcept nogil
