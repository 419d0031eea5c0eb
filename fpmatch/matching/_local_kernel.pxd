# Types of the kernel, and what other kernels may use of it.
cimport cython
cdef class NeighbourIndex:
    cdef readonly Py_ssize_t minutiae, size, half
    cdef readonly double per_px
    cdef double slack, least
    cdef double[:, ::1] middle
    cdef readonly float[:, ::1] entry
    cdef readonly int[::1] owner, start, item
    cdef double[::1] best, total, root_weight

    @cython.locals(
        i=cython.Py_ssize_t, k=cython.Py_ssize_t, e=cython.Py_ssize_t, n=cython.Py_ssize_t,
        row=cython.Py_ssize_t, column=cython.Py_ssize_t, turn=cython.Py_ssize_t,
        turns=cython.Py_ssize_t, cell=cython.Py_ssize_t, cells=cython.Py_ssize_t,
        u=cython.double, v=cython.double, c=cython.double, s=cython.double, reach=cython.double,
    )
    cdef int _list(
        self, int[::1] count, float[:, :, ::1] frame, bint filling
    ) noexcept nogil
    cdef Py_ssize_t _line(self, double place) noexcept nogil
    @cython.locals(
        i=cython.Py_ssize_t, j=cython.Py_ssize_t, k=cython.Py_ssize_t, e=cython.Py_ssize_t,
        at=cython.Py_ssize_t, cell=cython.Py_ssize_t, n=cython.Py_ssize_t, u=cython.double,
        v=cython.double, c=cython.double, s=cython.double, precision=cython.double,
        weight=cython.double, near=cython.double, scale=cython.double,
        entry=cython.float[:, ::1], owner=cython.int[::1], item=cython.int[::1],
        best=cython.double[::1], total=cython.double[::1],
    )
    cpdef int to_prints_before(
        self, int[::1] count, float[:, :, ::1] frame, Py_ssize_t minutiae, double min_cosine,
        float[:, ::1] similarity,
    ) noexcept nogil
    @cython.locals(
        i=cython.Py_ssize_t, j=cython.Py_ssize_t, k=cython.Py_ssize_t, e=cython.Py_ssize_t,
        m=cython.Py_ssize_t, at=cython.Py_ssize_t, cell=cython.Py_ssize_t, n=cython.Py_ssize_t,
        u=cython.double, v=cython.double, c=cython.double, s=cython.double, weight=cython.double,
        precision=cython.double,
        near=cython.double, scale=cython.double, entry=cython.float[:, ::1],
        item=cython.int[::1], root_weight=cython.double[::1], best=cython.double[::1],
        total=cython.double[::1],
    )
    cpdef int to_prints_after(
        self, int[::1] count, float[:, :, ::1] frame, Py_ssize_t minutiae, double min_cosine,
        float[:, ::1] similarity,
    ) noexcept nogil

@cython.locals(
    i=cython.Py_ssize_t, j=cython.Py_ssize_t, share=cython.double, raw=cython.double
)
cpdef int normalize_by_size(
    float[:, ::1] similarity, int[::1] count_a, Py_ssize_t minutiae_a, int[::1] count_b,
    Py_ssize_t minutiae_b, int fewest,
) noexcept nogil
