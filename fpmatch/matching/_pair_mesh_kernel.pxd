# Types of the kernel, and what other kernels may use of it.
cimport cython
cdef class PairMesh:
    cdef readonly Py_ssize_t capacity, vertices, triangles
    cdef readonly double[::1] ax, ay, bx, by
    cdef readonly int[:, ::1] corner
    cdef readonly int[::1] owner, vertex_of
    cdef readonly double[:, ::1] predicted
    cdef readonly double[::1] nearest, place_agreement, weight_agreement, fullness
    cdef double[:, ::1] circle
    cdef int[::1] fan_start, fan_from, fan_to, following, ring, inside
    cdef long long[::1] side
    cdef int[::1] side_from, side_to
    cdef double[::1] weight, place, other_place
    cdef int ring_size
    cdef readonly double places, weights, full, strain
    cdef readonly int turned, edges
    cdef double frame_margin_px, place_scale, residual_px, residual_per_px

    @cython.locals(
        i=cython.Py_ssize_t, v=cython.Py_ssize_t, k=cython.Py_ssize_t, low_x=cython.double,
        low_y=cython.double, high_x=cython.double, high_y=cython.double, middle_x=cython.double,
        middle_y=cython.double, radius=cython.double,
    )
    cpdef int build(
        self, double[:, ::1] a, Py_ssize_t size_a, double[:, ::1] b, int[::1] partner,
        double c, double s, double x, double y,
    ) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, following=cython.Py_ssize_t, t=cython.Py_ssize_t, p=cython.Py_ssize_t,
        q=cython.Py_ssize_t, area=cython.double, x=cython.double, y=cython.double,
        removed=cython.int,
    )
    cdef bint _insert(self, Py_ssize_t v) noexcept nogil
    @cython.locals(
        ux=cython.double, uy=cython.double, vx=cython.double, vy=cython.double, area=cython.double,
        u2=cython.double, v2=cython.double, x=cython.double, y=cython.double,
    )
    cdef int _put_triangle(
        self, Py_ssize_t t, Py_ssize_t p, Py_ssize_t q, Py_ssize_t r
    ) noexcept nogil
    @cython.locals(
        t=cython.Py_ssize_t, k=cython.Py_ssize_t, e=cython.Py_ssize_t, f=cython.Py_ssize_t,
        kept=cython.Py_ssize_t, dx=cython.double, dy=cython.double, found=cython.int,
        u=cython.longlong, v=cython.longlong, back=cython.longlong,
    )
    cdef int _cavity(self, double x, double y) noexcept nogil
    @cython.locals(
        t=cython.Py_ssize_t, e=cython.Py_ssize_t, v=cython.Py_ssize_t, at=cython.Py_ssize_t,
    )
    cdef int _sort_fans(self) noexcept nogil
    @cython.locals(k=cython.Py_ssize_t, v=cython.int)
    cdef int _chain(self, int[::1] start, int[::1] end, Py_ssize_t first, Py_ssize_t last) noexcept nogil
    @cython.locals(i=cython.Py_ssize_t, scale=cython.double, found=cython.int)
    cpdef int predict(
        self, double[:, ::1] a, Py_ssize_t size_a, double[:, ::1] b, int[::1] partner,
        double c, double s, double x, double y, bint measured,
    ) noexcept nogil
    @cython.locals(v=cython.Py_ssize_t)
    cdef int _find_ring(self, double[:, ::1] a, Py_ssize_t i) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, v=cython.Py_ssize_t, px=cython.double, py=cython.double,
        x=cython.double, y=cython.double, c=cython.double, s=cython.double, ax=cython.double,
        ay=cython.double, bx=cython.double, by=cython.double, length2=cython.double,
        weight=cython.double, nearest2=cython.double,
    )
    cdef bint _predict_one(self, double[:, ::1] a, Py_ssize_t i) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, v=cython.Py_ssize_t, u=cython.Py_ssize_t, radius=cython.double,
        on_pairs=cython.double, dx=cython.double, dy=cython.double, length_a=cython.double,
        length_b=cython.double,
    )
    cdef int _measure_one(
        self, double[:, ::1] a, Py_ssize_t i, double[:, ::1] b, Py_ssize_t j
    ) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, following=cython.Py_ssize_t, v=cython.Py_ssize_t, u=cython.Py_ssize_t,
        dx=cython.double, dy=cython.double, around_a=cython.double, around_b=cython.double,
        mean=cython.double, square=cython.double,
    )
    cdef double _place_agreement(self) noexcept nogil
    cpdef double mean_strain(self) noexcept nogil
