# What other kernels may use of this one. Arrays may be mapped from a file that cannot be written.
cdef int second(int word) noexcept nogil
cpdef int code_neighbours(
    const int[::1] count, const float[:, :, ::1] frame, const double[:, ::1] share,
    const unsigned char[::1] coded, double per_px, unsigned short[:, ::1] word,
) noexcept nogil
cpdef int code_flow(
    const double[:, ::1] points, const unsigned char[::1] turn, const unsigned char[:, ::1] cell,
    int first_row, int first_column, double step, const double[:, ::1] places,
    unsigned char[:, ::1] word,
) noexcept nogil


cdef class Prefilter:
    cdef unsigned long long[::1] around, along, turned_so, beside
    cdef int[::1] step, used, own_row, own_turn, start, angle, first_of_row, explained_by, weighing
    cdef int used_words
    cdef readonly int coded
    cdef bint has_flow
    cdef double[:, ::1] own_xy, a, b
    cdef double[::1] cosine_of, sine_of
    cdef unsigned char[::1] which
    cdef unsigned long long ones, twos, fours, eights
    cdef int[:, ::1] pair, turned, row
    cdef int most, most_turn
    cdef double near2, spread2

    cpdef int enter(
        self, const float[:, ::1] xy, const unsigned char[::1] turn,
        const unsigned short[:, ::1] around, const unsigned char[:, ::1] along, bint has_flow,
    ) noexcept nogil
    cpdef int weigh(
        self, Py_ssize_t first, Py_ssize_t last, const float[:, ::1] xy,
        const unsigned char[::1] turn, const unsigned short[:, ::1] around,
        const unsigned char[:, ::1] along, bint has_flow, bint other_first,
    ) noexcept nogil
    cpdef int weigh_many(
        self, Py_ssize_t first, const long long[::1] start, const float[:, ::1] xy,
        const unsigned char[::1] turn, const unsigned short[:, ::1] around,
        const unsigned char[:, ::1] along, const unsigned char[::1] has_flow, int[::1] weight,
    ) noexcept nogil
    cdef int _pair(
        self, Py_ssize_t first, Py_ssize_t last, const unsigned short[:, ::1] around,
        const unsigned char[:, ::1] along, bint has_flow,
    ) noexcept nogil
    cdef Py_ssize_t _second(self, unsigned short word) noexcept nogil
    cdef Py_ssize_t _along(self, Py_ssize_t k, unsigned char word) noexcept nogil
    cdef int _count(
        self, unsigned long long a, unsigned long long b, unsigned long long c,
        unsigned long long d, unsigned long long e, unsigned long long f, unsigned long long g,
        unsigned long long h, unsigned long long i, unsigned long long j, unsigned long long k,
        unsigned long long m,
    ) noexcept nogil
    cdef int _turn_over(self, int pairs) noexcept nogil
    cdef int _best_of(self, int pairs) noexcept nogil
    cdef int _place(
        self, int pairs, Py_ssize_t first, const float[:, ::1] xy, const unsigned char[::1] turn,
        bint other_first,
    ) noexcept nogil
    cdef int _explained(self, int pairs) noexcept nogil
