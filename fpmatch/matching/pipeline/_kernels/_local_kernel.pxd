# Types of the kernel, and what other kernels may use of it.
cdef class NeighbourIndex:
    cdef readonly Py_ssize_t minutiae, size, half
    cdef readonly double per_px
    cdef double slack, least
    cdef double[:, ::1] middle
    cdef readonly double[:, ::1] entry
    cdef readonly int[::1] owner, start, item
    cdef double[::1] best, total, root_weight

    cdef int _list(
        self, int[::1] count, float[:, :, ::1] frame, bint filling
    ) noexcept nogil
    cdef Py_ssize_t _line(self, double place) noexcept nogil
    cpdef int to_prints(
        self, int[::1] count, float[:, :, ::1] frame, Py_ssize_t minutiae, double min_cosine,
        float[:, ::1] similarity, bint before,
    ) noexcept nogil

cpdef int normalize_by_size(
    float[:, ::1] similarity, int[::1] count_a, Py_ssize_t minutiae_a, int[::1] count_b,
    Py_ssize_t minutiae_b, int fewest,
) noexcept nogil
