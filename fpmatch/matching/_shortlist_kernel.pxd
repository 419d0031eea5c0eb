# Arrays may be mapped from a file that cannot be written: const.
cpdef int code_neighbours(
    const long long[::1] start, const float[:, ::1] xy, const float[:, ::1] direction,
    const unsigned char[::1] turn, const unsigned char[::1] count,
    const unsigned char[:, ::1] neighbour, double per_px, int half, unsigned short[:, ::1] word,
) noexcept nogil
cpdef int code_flow(
    const long long[::1] start, const float[:, ::1] xy, const float[:, ::1] direction,
    const unsigned char[::1] turn, const unsigned char[::1] cell, const long long[::1] cell_start,
    const int[:, ::1] shape, const double[::1] step, const unsigned char[::1] has_flow,
    double[:, ::1] places, unsigned char[:, ::1] word,
) noexcept nogil


cdef class Sieve:
    cdef unsigned long long[::1] around, along
    cdef bint has_flow
    cdef Py_ssize_t minutiae
    cdef const float[:, ::1] xy
    cdef const unsigned char[::1] turn
    cdef double[::1] cosine_of, sine_of
    cdef unsigned char[::1] which
    cdef unsigned long long ones, twos, fours, eights
    cdef int[::1] own, other, weight, angle
    cdef double[:, ::1] x, y
    cdef int most, most_turn
    cdef double near, spread

    cdef int _enter_neighbours(
        self, int[::1] count, float[:, :, ::1] frame, double per_px, int half, double reach,
        double cosine,
    ) noexcept
    cdef int _line(self, double place, int side) noexcept
    cdef int _enter_flow(self, double[:, ::1] flow, double bins) noexcept
    cpdef int weigh(
        self, Py_ssize_t first, const long long[::1] start, const float[:, ::1] xy,
        const unsigned char[::1] turn, const unsigned short[:, ::1] around,
        const unsigned char[:, ::1] along, const unsigned char[::1] has_flow, int[::1] score,
    ) noexcept nogil
    cdef int _pair(
        self, long long first, long long last, const unsigned short[:, ::1] around,
        const unsigned char[:, ::1] along, bint has_flow,
    ) noexcept nogil
    cdef int _count(
        self, unsigned long long a, unsigned long long b, unsigned long long c,
        unsigned long long d, unsigned long long e, unsigned long long f, unsigned long long g,
        unsigned long long h, unsigned long long i, unsigned long long j, unsigned long long k,
        unsigned long long m,
    ) noexcept nogil
    cdef int _best_of(self, int pairs) noexcept nogil
    cdef int _explained(
        self, int pairs, long long first, const float[:, ::1] xy, const unsigned char[::1] turn
    ) noexcept nogil
