# What other kernels may use of this one.
cdef class LightTable:
    cdef readonly Py_ssize_t size_a, size_b
    cdef readonly double[:, ::1] a, b, laid, transforms, apart, pull, moments
    cdef readonly double[::1] reach, weight, rival_weight, support, nearest, own_moments
    cdef readonly double[::1] best_weight
    cdef readonly double[:, ::1] best_bent
    cdef public int pairs, best_pairs
    cdef readonly int[::1] partner, paired, rival, chosen, known, best_partner, start, item
    cdef readonly int[::1] spent
    cdef int[:, ::1] sketched
    cdef Py_ssize_t sketches
    cdef public double c, s, x, y
    cdef readonly double best_c, best_s, best_x, best_y
    cdef readonly double min_cosine, seed_near, seed_spread, seed_far, rigid_reach
    cdef readonly double bend_scale, bend_near, bend_spread, bend_far, farthest
    cdef readonly int candidates, first_seeds, rigid_rounds, bend_rounds
    cdef double x0, y0, per_px
    cdef int columns, rows

    cpdef int put_a(self, double[:, ::1] points, Py_ssize_t size) noexcept nogil
    cpdef int put_b(self, double[:, ::1] points, Py_ssize_t size) noexcept nogil
    cdef int _line(self, double place) noexcept nogil
    cpdef int propose(self, int[:, ::1] seeds, Py_ssize_t count) noexcept nogil
    cpdef int propose_more(
        self, int[:, ::1] seeds, Py_ssize_t known, Py_ssize_t count
    ) noexcept nogil
    cpdef double sketch(self, Py_ssize_t k) noexcept nogil
    cpdef double take(self, Py_ssize_t k) noexcept nogil
    cpdef int keep(self) noexcept nogil
    cpdef int support_of_seeds(
        self, int[:, ::1] seeds, Py_ssize_t first, Py_ssize_t last
    ) noexcept nogil
    cpdef int choose(self, Py_ssize_t count) noexcept nogil
    cpdef double begin(self) noexcept nogil
    cpdef double finish(self) noexcept nogil
    cpdef int bend(self) noexcept nogil
    cpdef int move(self) noexcept nogil
    cpdef double pair(self, Py_ssize_t row) noexcept nogil
    cpdef int fit(self) noexcept nogil
    cdef int _know(self, Py_ssize_t k) noexcept nogil
