# Types of the kernel. Arrays may be mapped from a file that cannot be written.
cimport cython


@cython.locals(
    e=cython.Py_ssize_t, i=cython.Py_ssize_t, j=cython.Py_ssize_t, dx=cython.double,
    dy=cython.double, length=cython.double, along=cython.double, bin_=cython.int, cell=cython.int,
    x=cython.int, y=cython.int,
)
cpdef int describe_edges(
    const double[:, ::1] points, const int[:, ::1] edge, unsigned short[::1] term,
    unsigned short[::1] pose,
) noexcept nogil
@cython.locals(share=cython.double, bin_=cython.int)
cdef int sector(double angle, int count) noexcept nogil
