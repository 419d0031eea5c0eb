# Types of the kernel, and what other kernels may use of it. Arrays may be mapped from a file that cannot be written.
cimport cython
cdef int second(int word) noexcept nogil
@cython.locals(
    i=cython.Py_ssize_t, k=cython.Py_ssize_t, m=cython.Py_ssize_t, u=cython.double, v=cython.double,
    t=cython.double, row=cython.int, column=cython.int, sector=cython.int, on_row=cython.int,
    on_column=cython.int, found=cython.int,
)
cpdef int encode_neighbours(
    const int[::1] count, const float[:, :, ::1] frame, const double[:, ::1] share,
    const unsigned char[::1] coded, double per_px, unsigned short[:, ::1] word,
) noexcept nogil
@cython.locals(
    i=cython.Py_ssize_t, k=cython.Py_ssize_t, x=cython.double, y=cython.double, c=cython.double,
    s=cython.double, relative=cython.double, code=cython.int,
)
cpdef int encode_orientations(
    const double[:, ::1] points, const unsigned char[::1] direction_bin, const unsigned char[:, ::1] cell,
    int first_row, int first_column, double step, const double[:, ::1] places,
    unsigned char[:, ::1] word,
) noexcept nogil


cdef class Prefilter:
    cdef unsigned long long[::1] neighbour_bits, orientation_bins, turned_so, beside
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

    @cython.locals(
        i=cython.Py_ssize_t, k=cython.Py_ssize_t, d=cython.int, b=cython.int, word=cython.int,
        words=cython.int, bit=cython.ulonglong,
    )
    cpdef int load(
        self, const float[:, ::1] xy, const unsigned char[::1] direction_bin,
        const unsigned short[:, ::1] neighbour_bits, const unsigned char[:, ::1] orientation_bins, bint has_flow,
    ) noexcept nogil
    @cython.locals(pairs=cython.int)
    cpdef int score(
        self, Py_ssize_t first, Py_ssize_t last, const float[:, ::1] xy,
        const unsigned char[::1] direction_bin, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins, bint has_flow, bint other_first,
    ) noexcept nogil
    @cython.locals(t=cython.Py_ssize_t)
    cpdef int score_many(
        self, Py_ssize_t first, const long long[::1] start, const float[:, ::1] xy,
        const unsigned char[::1] direction_bin, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins, const unsigned char[::1] has_flow, int[::1] weight,
    ) noexcept nogil
    @cython.locals(
        j=cython.Py_ssize_t, place=cython.Py_ssize_t, found=cython.int, weight=cython.int,
        any_=cython.ulonglong, lowest=cython.ulonglong, carry=cython.ulonglong, n1=cython.ulonglong,
        n2=cython.ulonglong, n4=cython.ulonglong, n8=cython.ulonglong, n16=cython.ulonglong,
        f1=cython.ulonglong, f2=cython.ulonglong, f4=cython.ulonglong, f8=cython.ulonglong,
        flowing=cython.bint,
    )
    cdef int _pair(
        self, Py_ssize_t first, Py_ssize_t last, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins, bint has_flow,
    ) noexcept nogil
    cdef Py_ssize_t _second(self, unsigned short word) noexcept nogil
    cdef Py_ssize_t _along(self, Py_ssize_t k, unsigned char word) noexcept nogil
    cdef int _count(
        self, unsigned long long a, unsigned long long b, unsigned long long c,
        unsigned long long d, unsigned long long e, unsigned long long f, unsigned long long g,
        unsigned long long h, unsigned long long i, unsigned long long j, unsigned long long k,
        unsigned long long m,
    ) noexcept nogil
    @cython.locals(k=cython.int, place=cython.int, behind=cython.int)
    cdef int _turn_over(self, int pairs) noexcept nogil
    @cython.locals(
        least=cython.int, above=cython.int, k=cython.int, kept=cython.int, equal=cython.int,
    )
    cdef int _best_of(self, int pairs) noexcept nogil
    @cython.locals(
        g=cython.Py_ssize_t, h=cython.Py_ssize_t, own=cython.Py_ssize_t, other=cython.Py_ssize_t,
        of_own=cython.Py_ssize_t, apart=cython.int,
    )
    cdef int _place(
        self, int pairs, Py_ssize_t first, const float[:, ::1] xy, const unsigned char[::1] direction_bin,
        bint other_first,
    ) noexcept nogil
    @cython.locals(
        left=cython.ulonglong, lowest=cython.ulonglong, g=cython.Py_ssize_t, h=cython.Py_ssize_t,
        direction_bin=cython.Py_ssize_t, best=cython.int, total=cython.int, last=cython.int,
        apart=cython.int, c=cython.double, s=cython.double, dx=cython.double, dy=cython.double,
        ex=cython.double, ey=cython.double,
    )
    cdef int _explained(self, int pairs) noexcept nogil
