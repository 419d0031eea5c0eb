# Types of the kernel, and what other kernels may use of it.


cdef class MinutiaGrid:
    cdef readonly int[::1] start, item
    cdef readonly double x0, y0, per_px, reach
    cdef readonly int columns, rows

    cpdef int load(self, double[:, ::1] points, Py_ssize_t size) noexcept nogil
    cdef int _line(self, double place) noexcept nogil
