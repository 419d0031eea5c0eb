# Types of the kernel. Arrays may be mapped from a file that cannot be written.
cimport cython


cpdef int count_votes(
    const unsigned int[::1] start, const unsigned int[::1] posting, const int[::1] term,
    const unsigned char[::1] weight, const int[::1] reading,
    const unsigned short[:, ::1] shift, const unsigned short[::1] factor, unsigned int[::1] cursor,
    unsigned int[::1] table, unsigned short[::1] votes,
) noexcept
@cython.locals(
    q=cython.Py_ssize_t, p=cython.Py_ssize_t, first=cython.Py_ssize_t, last=cython.Py_ssize_t,
    at=cython.uint, end=cython.uint, found=cython.uint, limit=cython.uint, own=cython.uint,
    cell=cython.uint, count=cython.uint, votes_each=cython.uint, cells=cython.p_uchar,
    counted=cython.p_uchar, place="const unsigned short *", here=cython.p_uint,
)
cdef int _count_votes(
    const unsigned int[::1] start, const unsigned int[::1] posting, const int[::1] term,
    const unsigned char[::1] weight, const int[::1] reading,
    const unsigned short[:, ::1] shift, const unsigned short[::1] factor, unsigned int[::1] cursor,
    unsigned int[::1] table, unsigned short[::1] votes,
) noexcept nogil
@cython.locals(
    t=cython.Py_ssize_t, k=cython.Py_ssize_t, before=cython.uint, p=cython.uint,
)
cpdef bint lists_ascend(
    const unsigned int[::1] start, const unsigned int[::1] posting, unsigned int prints,
) noexcept nogil
