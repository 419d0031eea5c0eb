# Types of the kernel, and what other kernels may use of it.
cdef class NeighbourIndex:
    cdef readonly Py_ssize_t minutiae, size
    cdef int fewest
    cdef double min_cosine
    cdef double[:, ::1] entry
    cdef int[::1] owner
    cdef double[::1] scale, best, total, share
    cdef unsigned long long[:, :, ::1] near
    cdef unsigned long long[::1] touched, word
    cdef int[::1] place, number

    cdef int _list(
        self, int[::1] count, float[:, :, ::1] frame, double slack, double c, double s
    ) noexcept nogil
    cdef Py_ssize_t _bin(self, Py_ssize_t axis, double value) noexcept nogil
    cdef Py_ssize_t _unpack(self, Py_ssize_t found) noexcept nogil
    cpdef int to_prints(
        self, int[::1] count, float[:, :, ::1] frame, Py_ssize_t minutiae,
        float[:, ::1] similarity, bint before,
    ) noexcept nogil
