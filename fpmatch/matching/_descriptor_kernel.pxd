# Types of the kernel. Arrays may be mapped from a file that cannot be written.
cimport cython
from fpmatch.matching._prefilter_kernel cimport Prefilter


cdef int place_of(int number) noexcept nogil
@cython.locals(column=cython.int, row=cython.int, cell=cython.int)
cdef int word_of(int dx, int dy, float c, float s, int turn) noexcept nogil


cdef class DescriptorWriter:
    cdef const float[::1] cosine, sine
    cdef readonly unsigned int[::1] content
    cdef int[::1] number
    cdef Py_ssize_t used

    @cython.locals(i=cython.Py_ssize_t, k=cython.Py_ssize_t, kept=cython.int)
    cpdef Py_ssize_t write(
        self, const int[:, ::1] places, bint whole, const unsigned char[::1] direction_bin,
        const int[:, ::1] neighbour, const unsigned short[:, ::1] neighbour_bits,
        const unsigned char[:, ::1] orientation_bins,
    ) noexcept nogil
    @cython.locals(
        at=cython.Py_ssize_t, k=cython.Py_ssize_t, j=cython.Py_ssize_t, count=cython.int,
        below=cython.longlong, lower=cython.int, c=cython.float, s=cython.float, dx=cython.int,
        dy=cython.int, word=cython.int, turn=cython.int, apart=cython.int,
        bins=cython.ulonglong, head=cython.ulonglong, bits=cython.uint,
    )
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

    @cython.locals(
        at=cython.Py_ssize_t, end=cython.Py_ssize_t, x=cython.float, y=cython.float,
        step=cython.float, n=cython.int, m=cython.Py_ssize_t, head=cython.uint, count=cython.int,
        last=cython.ulonglong, follow=cython.int, as_they_are=cython.int, place=cython.int,
        follows=cython.int,
    )
    cpdef int unpack(self, Py_ssize_t k) noexcept nogil
    cdef int _damaged(self, int n) noexcept nogil
    @cython.locals(i=cython.int, place=cython.int)
    cdef int _forget(self, int n) noexcept nogil
    @cython.locals(t=cython.Py_ssize_t, k=cython.Py_ssize_t, n=cython.int)
    cpdef int score(
        self, Prefilter tables, const long long[::1] which, int[::1] weight
    ) noexcept
    @cython.locals(at=cython.Py_ssize_t)
    cdef int _fetch(self, Py_ssize_t k) noexcept nogil
    @cython.locals(at=cython.Py_ssize_t, k=cython.int, count=cython.int)
    cdef int _copy_words(self, Py_ssize_t i) noexcept nogil
    @cython.locals(k=cython.int, count=cython.int, counts=cython.int)
    cdef int _omit_words(self, Py_ssize_t i) noexcept nogil
    @cython.locals(at=cython.Py_ssize_t, k=cython.int, four=cython.uint)
    cdef int _find_neighbours(self, Py_ssize_t i) noexcept nogil
    @cython.locals(
        k=cython.int, own=cython.int, x=cython.int, y=cython.int, turn=cython.int,
        c=cython.float, s=cython.float, count=cython.int, lower=cython.int, other=cython.int,
        word=cython.int, counts=cython.int,
    )
    cdef int _write_words(self, Py_ssize_t i) noexcept nogil
    @cython.locals(last=cython.ulonglong)
    cdef int _spread(self, Py_ssize_t n, unsigned long long bins) noexcept nogil
