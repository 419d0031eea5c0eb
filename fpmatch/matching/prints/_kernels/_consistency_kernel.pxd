# Types of the kernel, and what other kernels may use of it.


cdef class PairSet:
    cdef int count, most, least, equal, most_turn
    cdef double near2, spread2
    cdef readonly double c, s, x, y
    cdef double[::1] cosine_of, sine_of
    cdef int[:, ::1] pair, turned, row
    cdef int[::1] start, angle, bound, of_weight
    cdef double[:, ::1] a, b
    cdef unsigned long long[::1] of_turn, consistent

    cdef int order_by_own(self, int own) noexcept nogil
    cdef int keep_best(self) noexcept nogil
    cdef int locate(
        self, int[::1] own_turn, double[:, ::1] own_xy, Py_ssize_t first, const float[:, ::1] xy,
        const unsigned char[::1] direction_bin, bint other_first,
    ) noexcept nogil
    cdef int consistent_weight(self) noexcept nogil
    cpdef bint fit(self, int weight) noexcept nogil
    cdef int _weight_with(self, Py_ssize_t h) noexcept nogil
