# Types of the kernel, and what other kernels may use of it. Arrays may be mapped from a file.
cimport cython
from fpmatch.matching._consistency_kernel cimport PairSet


cdef class Prefilter:
    cdef unsigned long long[::1] neighbour_table
    cdef unsigned long long[:, ::1] orientation_table
    cdef int[::1] step, used, own_row, own_turn
    cdef int used_words
    cdef readonly int coded
    cdef bint has_flow
    cdef double[:, ::1] own_xy
    cdef unsigned char[::1] which
    cdef unsigned long long ones, twos, fours, eights
    cdef PairSet pairs

    @cython.locals(
        i=cython.Py_ssize_t, k=cython.Py_ssize_t, d=cython.int, b=cython.int, word=cython.int,
        words=cython.int, bit=cython.ulonglong,
    )
    cpdef int load(
        self, const float[:, ::1] xy, const unsigned char[::1] direction_bin,
        const unsigned short[:, ::1] neighbour_bits, const unsigned char[:, ::1] orientation_bins, bint has_flow,
    ) noexcept nogil
    cpdef int score(
        self, Py_ssize_t first, Py_ssize_t last, const float[:, ::1] xy,
        const unsigned char[::1] direction_bin, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins, bint flowing, bint other_first,
    ) noexcept nogil
    @cython.locals(
        t=cython.Py_ssize_t, begin=cython.Py_ssize_t, end=cython.Py_ssize_t, flowing=cython.bint,
    )
    cpdef int score_many(
        self, Py_ssize_t first, const long long[::1] start, const float[:, ::1] xy,
        const unsigned char[::1] direction_bin, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins, const unsigned char[::1] has_flow, int[::1] weight,
    ) noexcept
    @cython.locals(
        j=cython.Py_ssize_t, place=cython.Py_ssize_t, weight=cython.int,
        any_=cython.ulonglong, lowest=cython.ulonglong, carry=cython.ulonglong, n1=cython.ulonglong,
        n2=cython.ulonglong, n4=cython.ulonglong, n8=cython.ulonglong, n16=cython.ulonglong,
        f1=cython.ulonglong, f2=cython.ulonglong, f4=cython.ulonglong, f8=cython.ulonglong,
    )
    cdef int _pair(
        self, Py_ssize_t first, Py_ssize_t last, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins, bint flowing,
    ) noexcept nogil
    cdef Py_ssize_t _second(self, unsigned short word) noexcept nogil
    @cython.locals(
        odd=cython.ulonglong, odd_1=cython.ulonglong, odd_2=cython.ulonglong,
        odd_3=cython.ulonglong, two_1=cython.ulonglong, two_2=cython.ulonglong,
        two_3=cython.ulonglong, two_4=cython.ulonglong, two_5=cython.ulonglong,
        two_6=cython.ulonglong, four_1=cython.ulonglong, four_2=cython.ulonglong,
        four_3=cython.ulonglong,
    )
    cdef int _count(
        self, unsigned long long a, unsigned long long b, unsigned long long c,
        unsigned long long d, unsigned long long e, unsigned long long f, unsigned long long g,
        unsigned long long h, unsigned long long i, unsigned long long j, unsigned long long k,
        unsigned long long m,
    ) noexcept nogil
