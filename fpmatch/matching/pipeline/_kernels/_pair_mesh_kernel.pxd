# Types of the kernel, and what other kernels may use of it.

# of `matching.constants`
cdef Py_ssize_t FRAME
cdef double FAR_AWAY, NEAR2, ROUNDING


cdef class PairMesh:
    cdef readonly Py_ssize_t vertices, triangles
    cdef readonly double[::1] ax, ay, bx, by
    cdef readonly int[:, ::1] corner
    cdef readonly int[::1] owner, vertex_of
    cdef readonly double[:, ::1] predicted
    cdef readonly double[::1] nearest
    cdef double[:, ::1] circle
    cdef int[::1] fan_start, fan_from, fan_to, following, ring, inside
    cdef long long[::1] side
    cdef int[::1] side_from, side_to
    cdef double[::1] weight, place, other_place
    cdef int ring_size
    cdef readonly double places, weights, full
    cdef double frame_margin_px, place_scale, residual_px, residual_per_px

    cpdef int build(
        self, double[:, ::1] a, Py_ssize_t size_a, double[:, ::1] b, int[::1] partner,
        double c, double s, double x, double y,
    ) noexcept nogil
    cdef bint _insert(self, Py_ssize_t v) noexcept nogil
    cdef int _put_triangle(
        self, Py_ssize_t t, Py_ssize_t p, Py_ssize_t q, Py_ssize_t r
    ) noexcept nogil
    cdef int _cavity(self, double x, double y) noexcept nogil
    cdef int _sort_fans(self) noexcept nogil
    cdef int _chain(self, int[::1] start, int[::1] end, Py_ssize_t first, Py_ssize_t last) noexcept nogil
    cpdef int predict(
        self, double[:, ::1] a, Py_ssize_t size_a, double[:, ::1] b, int[::1] partner,
        double c, double s, double x, double y, bint measured,
    ) noexcept nogil
    cdef bint _predict_one(self, double[:, ::1] a, Py_ssize_t i) noexcept nogil
    cdef int _measure_one(
        self, double[:, ::1] a, Py_ssize_t i, double[:, ::1] b, Py_ssize_t j
    ) noexcept nogil
