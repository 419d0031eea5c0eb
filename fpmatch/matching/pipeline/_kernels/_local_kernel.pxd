# Types of the kernel, and what other kernels may use of it.
cdef class NeighbourIndex:
    cdef readonly Py_ssize_t minutiae, size
    cdef double slack, least, min_cosine
    cdef int fewest
    cdef double[:, ::1] middle, entry
    cdef int[::1] owner, start, item
    cdef double[::1] best, total, root_weight, share

    cdef int _list(
        self, int[::1] count, float[:, :, ::1] frame, bint filling
    ) noexcept nogil
    cdef Py_ssize_t _line(self, double place) noexcept nogil
    cpdef int to_prints(
        self, int[::1] count, float[:, :, ::1] frame, Py_ssize_t minutiae,
        float[:, ::1] similarity, bint before,
    ) noexcept nogil
