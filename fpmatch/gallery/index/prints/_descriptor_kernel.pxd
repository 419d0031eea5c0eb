# Types of the kernel. Arrays may be mapped from a file that cannot be written.
from fpmatch.matching.prints._kernels._prefilter_kernel cimport Prefilter


cdef int place_of(int number) noexcept nogil
cdef int word_of(int dx, int dy, float c, float s, int turn) noexcept nogil


cdef class DescriptorWriter:
    cdef const float[::1] cosine, sine
    cdef readonly unsigned int[::1] content
    cdef int[::1] number
    cdef Py_ssize_t used

    cpdef Py_ssize_t write(
        self, const int[:, ::1] places, bint whole, const unsigned char[::1] direction_bin,
        const int[:, ::1] neighbour, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins,
    ) noexcept nogil
    cdef int _write_one(
        self, Py_ssize_t i, const int[:, ::1] places, bint whole,
        const unsigned char[::1] direction_bin, const int[:, ::1] neighbour,
        const unsigned short[:, ::1] neighbour_bits, const unsigned char[:, ::1] orientation_bins,
    ) noexcept nogil


cdef class DescriptorReader:
    cdef const float[::1] cosine, sine
    cdef const long long[::1] start
    cdef const unsigned int[::1] content
    cdef const unsigned char[::1] step, has_flow
    cdef const float[:, ::1] origin
    cdef readonly float[:, ::1] xy
    cdef readonly unsigned char[::1] direction_bin
    cdef readonly unsigned short[:, ::1] neighbour_bits
    cdef readonly unsigned char[:, ::1] orientation_bins
    cdef long long[::1] words_at
    cdef int[::1] head, count, below, follow, as_they_are, placed
    cdef int[:, ::1] near
    cdef int[::1] all_near
    cdef unsigned short[::1] all_bits
    cdef unsigned int[::1] two_words
    cdef unsigned int[:, ::1] four_bins
    cdef int filled

    cpdef int unpack(self, Py_ssize_t k) noexcept nogil
    cdef int _damaged(self, int n) noexcept nogil
    cdef int _forget(self, int n) noexcept nogil
    cpdef int score(
        self, Prefilter tables, const long long[::1] which, int[::1] weight
    ) noexcept
    cdef int _fetch(self, Py_ssize_t k) noexcept nogil
    cdef int _copy_words(self, Py_ssize_t i) noexcept nogil
    cdef int _omit_words(self, Py_ssize_t i) noexcept nogil
    cdef int _find_neighbours(self, Py_ssize_t i) noexcept nogil
    cdef int _write_words(self, Py_ssize_t i) noexcept nogil
    cdef int _spread(self, Py_ssize_t n, unsigned long long bins) noexcept nogil
