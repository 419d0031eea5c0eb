# Types of the kernel, and what other kernels may use of it.
cimport cython


cdef class PairSet:
    cdef int count, most, least, equal, most_turn
    cdef double near2, spread2
    cdef double[::1] cosine_of, sine_of
    cdef int[:, ::1] pair, turned, row
    cdef int[::1] start, angle, bound, of_weight
    cdef double[:, ::1] a, b
    cdef unsigned long long[::1] of_turn, consistent

    @cython.locals(k=cython.int, entry=cython.int, place=cython.int)
    cdef int order_by_own(self, int own) noexcept nogil
    @cython.locals(k=cython.int, entry=cython.int, kept=cython.int, equal=cython.int)
    cdef int keep_best(self) noexcept nogil
    @cython.locals(
        g=cython.Py_ssize_t, h=cython.Py_ssize_t, own=cython.Py_ssize_t, other=cython.Py_ssize_t,
        of_own=cython.Py_ssize_t, k=cython.Py_ssize_t, apart=cython.int,
    )
    cdef int locate(
        self, int[::1] own_turn, double[:, ::1] own_xy, Py_ssize_t first, const float[:, ::1] xy,
        const unsigned char[::1] direction_bin, bint other_first,
    ) noexcept nogil
    @cython.locals(
        left=cython.ulonglong, g=cython.Py_ssize_t, h=cython.Py_ssize_t, turn=cython.Py_ssize_t,
        best=cython.int, best_bound=cython.int, apart=cython.int, near=cython.bint,
        c=cython.double, s=cython.double, dx=cython.double, dy=cython.double, ex=cython.double,
        ey=cython.double,
    )
    cdef int consistent_weight(self) noexcept nogil
    @cython.locals(
        left=cython.ulonglong, counted=cython.ulonglong, g=cython.Py_ssize_t, last=cython.int,
        total=cython.int,
    )
    cdef int _weight_with(self, Py_ssize_t h) noexcept nogil
