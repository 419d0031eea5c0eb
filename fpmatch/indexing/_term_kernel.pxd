# Types of the kernel. Arrays may be mapped from a file that cannot be written.
cimport cython


@cython.locals(
    e=cython.Py_ssize_t, i=cython.Py_ssize_t, j=cython.Py_ssize_t, dx=cython.double,
    dy=cython.double, length=cython.double, along=cython.double, bin_=cython.int, cell=cython.int,
    x=cython.int, y=cython.int,
)
cpdef int describe_edges(
    const double[:, ::1] points, const int[:, ::1] edge, const double[::1] curvature,
    unsigned short[::1] term, unsigned short[::1] pose,
) noexcept nogil
@cython.locals(
    e=cython.Py_ssize_t, i=cython.Py_ssize_t, j=cython.Py_ssize_t, dx=cython.double,
    dy=cython.double, length=cython.double, scale=cython.double, x=cython.double,
    y=cython.double, column=cython.double, row=cython.double, at_x=cython.double,
    at_y=cython.double, c=cython.double, s=cython.double, mean_c=cython.double,
    mean_s=cython.double, share=cython.double, known=cython.bint, side=cython.int, k=cython.int,
    which=cython.int,
)
cpdef int measure_curvatures(
    const double[:, ::1] points, const int[:, ::1] edge, const unsigned char[:, ::1] code,
    const double[:, ::1] doubled, double step, double first_row, double first_column,
    double[::1] curvature,
) noexcept nogil
@cython.locals(share=cython.double, bin_=cython.int)
cdef int sector(double angle, int count) noexcept nogil
