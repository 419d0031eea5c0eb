# Types of the kernel, and what other kernels may use of it.
cimport cython
cdef class Relaxation:
    cdef readonly int capacity, count
    cdef readonly int[::1] first, second
    cdef readonly double[::1] relaxed
    cdef readonly double[:, ::1] support
    cdef double[:, ::1] place, rotation
    cdef double[::1] gathered, row_best
    cdef int[::1] row_column, column_taken, explained
    cdef double distance_px, distance_per_px, min_rotation_cosine, min_angle_cosine
    cdef double inertia, least_share, least_seed_share
    cdef readonly double strength
    cdef int rounds

    @cython.locals(
        i=cython.Py_ssize_t, j=cython.Py_ssize_t, k=cython.Py_ssize_t, m=cython.Py_ssize_t,
    )
    cpdef int load(
        self, double[:, ::1] a, Py_ssize_t size_a, double[:, ::1] b, Py_ssize_t size_b,
        float[:, ::1] similarity,
    ) noexcept nogil
    @cython.locals(i=cython.Py_ssize_t, best=cython.Py_ssize_t, most=cython.double)
    cdef int _select(
        self, Py_ssize_t size_a, Py_ssize_t size_b, float[:, ::1] similarity
    ) noexcept nogil
    @cython.locals(j=cython.Py_ssize_t, most=cython.double, column=cython.int)
    cdef int _best_of_row(self, Py_ssize_t i, Py_ssize_t size_b, float[:, ::1] similarity) noexcept nogil
    @cython.locals(
        c=cython.double, s=cython.double, ax=cython.double, ay=cython.double, bx=cython.double,
        by=cython.double, length_a=cython.double, length_b=cython.double, shorter=cython.double,
        distance=cython.double, rotation=cython.double, angle=cython.double,
    )
    cdef double _compatibility(self, Py_ssize_t k, Py_ssize_t l) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, m=cython.Py_ssize_t, r=cython.int, n=cython.int, value=cython.double,
        share=cython.double, support=cython.double[:, ::1], relaxed=cython.double[::1],
        gathered=cython.double[::1],
    )
    cdef int _relax(self) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, value=cython.double, first=cython.double,
        second=cython.double, third=cython.double, fourth=cython.double,
    )
    cdef double _strongest(self) noexcept nogil
    @cython.locals(
        i=cython.Py_ssize_t, k=cython.Py_ssize_t, seed=cython.Py_ssize_t, most=cython.double,
        strongest=cython.double, value=cython.double, pairs=cython.int,
    )
    cpdef int hypothesis(
        self, Py_ssize_t size_a, bint whole, int[::1] partner, double[::1] weight
    ) noexcept nogil
    @cython.locals(k=cython.Py_ssize_t, found=cython.int)
    cpdef int explain(self, int[::1] partner) noexcept nogil
    @cython.locals(k=cython.Py_ssize_t, total=cython.double)
    cpdef double support_of(self, int[::1] partner) noexcept nogil
