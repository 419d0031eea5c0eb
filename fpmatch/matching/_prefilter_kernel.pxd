# Types of the kernel, and what other kernels may use of it. Arrays may be mapped from a file.
cimport cython
from fpmatch.matching._bit_lanes cimport bit_lanes
from fpmatch.matching._consistency_kernel cimport PairSet


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
        table="const unsigned long long *", at="const unsigned long long *",
        grid=cython.int, cells_a="const unsigned short *", cells_b="const unsigned short *",
        bins_a="const unsigned char *", bins_b="const unsigned char *", own_of=cython.p_int,
        other_of=cython.p_int, weight_of=cython.p_int, of_weight=cython.p_int,
        j=cython.Py_ssize_t, of_a=cython.Py_ssize_t, of_b=cython.Py_ssize_t, lanes=cython.int,
        lane=cython.int, k=cython.int, found=cython.int, above=cython.int, limit=cython.int,
        least=cython.int, most=cython.int, room=cython.int,
        place=cython.int, weight=cython.int, bits=cython.ulonglong, b1=cython.ulonglong,
        b2=cython.ulonglong, b4=cython.ulonglong, b8=cython.ulonglong, b16=cython.ulonglong,
        b32=cython.ulonglong, v=bit_lanes, w=bit_lanes, x=bit_lanes, y=bit_lanes, two=bit_lanes,
        four=bit_lanes, eight=bit_lanes, more=bit_lanes, some=bit_lanes, n1=bit_lanes,
        n2=bit_lanes, n4=bit_lanes, n8=bit_lanes, n16=bit_lanes, f1=bit_lanes, f2=bit_lanes,
        f4=bit_lanes, f8=bit_lanes, s1=bit_lanes, s2=bit_lanes, s4=bit_lanes, s8=bit_lanes,
        s16=bit_lanes, s32=bit_lanes, t1=bit_lanes, t2=bit_lanes, t4=bit_lanes, t8=bit_lanes,
        t16=bit_lanes,
    )
    cdef int _pair(
        self, Py_ssize_t first, Py_ssize_t last, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins, bint flowing, bint other_first,
    ) noexcept nogil
    @cython.locals(
        words="const unsigned short *", one=cython.p_ushort, other=cython.p_ushort,
        k=cython.Py_ssize_t, cell=cython.int,
    )
    cdef int _find_cells(
        self, Py_ssize_t first, Py_ssize_t count, const unsigned short[:, ::1] neighbour_bits
    ) noexcept nogil
