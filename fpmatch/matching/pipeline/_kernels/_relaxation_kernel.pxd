# Types of the kernel, and what other kernels may use of it.
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

    cpdef int load(
        self, double[:, ::1] a, Py_ssize_t size_a, double[:, ::1] b, Py_ssize_t size_b,
        float[:, ::1] similarity,
    ) noexcept nogil
    cdef int _select(
        self, Py_ssize_t size_a, Py_ssize_t size_b, float[:, ::1] similarity
    ) noexcept nogil
    cdef int _best_of_row(self, Py_ssize_t i, Py_ssize_t size_b, float[:, ::1] similarity) noexcept nogil
    cdef double _compatibility(self, Py_ssize_t k, Py_ssize_t l) noexcept nogil
    cdef int _relax(self) noexcept nogil
    cpdef int hypothesis(
        self, Py_ssize_t size_a, bint whole, int[::1] partner, double[::1] weight
    ) noexcept nogil
    cpdef int explain(self, int[::1] partner) noexcept nogil
    cpdef double support_of(self, int[::1] partner) noexcept nogil
