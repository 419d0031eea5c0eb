# Types of the kernel. Arrays may be mapped from a file that cannot be written.
cimport cython


@cython.locals(
    q=cython.Py_ssize_t, p=cython.Py_ssize_t, first=cython.Py_ssize_t, last=cython.Py_ssize_t,
    at=cython.uint, end=cython.uint, found=cython.uint, turn=cython.int, place=cython.int,
    x=cython.int, y=cython.int, window=cython.Py_ssize_t, count=cython.int, best=cython.int,
)
cpdef int count_votes(
    const unsigned int[::1] start, const unsigned int[::1] posting, const int[::1] term,
    const unsigned char[::1] weight, const int[::1] reading, const unsigned char[::1] rotation,
    const unsigned short[:, ::1] shift, unsigned int[::1] cursor, unsigned char[::1] table,
    unsigned char[::1] votes,
) noexcept nogil
