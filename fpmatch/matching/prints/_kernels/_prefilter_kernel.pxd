# Types of the kernel, and what other kernels may use of it. Arrays may be mapped from a file.


cdef class Prefilter:
    cdef unsigned long long[::1] neighbour_table
    cdef unsigned long long[:, ::1] orientation_table
    cdef unsigned short[:, :, ::1] cell
    cdef int[::1] own_turn
    cdef int coded, count, most, least, equal, most_turn
    cdef bint has_flow
    cdef double near2, spread2
    cdef double[::1] cosine_of, sine_of
    cdef double[:, ::1] own_xy, a, b
    cdef int[:, ::1] pair, row
    cdef int[::1] angle, bound, of_weight
    cdef unsigned long long[::1] of_turn, consistent

    cpdef int load(
        self, const float[:, ::1] xy, const unsigned char[::1] direction_bin,
        const unsigned short[:, ::1] neighbour_bits, const unsigned char[:, ::1] orientation_bins,
        bint has_flow,
    ) noexcept nogil
    cpdef int score(
        self, Py_ssize_t first, Py_ssize_t last, const float[:, ::1] xy,
        const unsigned char[::1] direction_bin, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins, bint flowing, bint other_first,
    ) noexcept nogil
    cdef int _pair(
        self, Py_ssize_t first, Py_ssize_t last, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins, bint flowing, bint other_first,
    ) noexcept nogil
    cdef int _find_cells(
        self, Py_ssize_t first, Py_ssize_t count, const unsigned short[:, ::1] neighbour_bits
    ) noexcept nogil
    cdef int _keep_best(self, bint other_first) noexcept nogil
    cdef int _locate(
        self, Py_ssize_t first, const float[:, ::1] xy, const unsigned char[::1] direction_bin,
        bint other_first,
    ) noexcept nogil
    cdef int _consistent_weight(self) noexcept nogil
    cdef int _weight_with(self, Py_ssize_t h) noexcept nogil
