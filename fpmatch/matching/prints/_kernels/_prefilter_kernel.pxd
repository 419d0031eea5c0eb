# Types of the kernel, and what other kernels may use of it. Arrays may be mapped from a file.
from fpmatch.matching.prints._kernels._consistency_kernel cimport PairSet


cdef class Prefilter:
    cdef unsigned long long[::1] neighbour_table
    cdef unsigned long long[:, ::1] orientation_table
    cdef unsigned short[:, :, ::1] cell
    cdef int[::1] used, own_turn
    cdef int used_words
    cdef readonly int coded
    cdef bint has_flow
    cdef double[:, ::1] own_xy
    cdef PairSet pairs

    cpdef int load(
        self, const float[:, ::1] xy, const unsigned char[::1] direction_bin,
        const unsigned short[:, ::1] neighbour_bits, const unsigned char[:, ::1] orientation_bins, bint has_flow,
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
