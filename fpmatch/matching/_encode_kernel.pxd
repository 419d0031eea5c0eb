# Types of the kernel. Arrays may be mapped from a file that cannot be written.
cimport cython


@cython.locals(place=cython.int)
cpdef int second(int word) noexcept nogil
@cython.locals(
    i=cython.Py_ssize_t, k=cython.Py_ssize_t, m=cython.Py_ssize_t, u=cython.double, v=cython.double,
    t=cython.double, row=cython.int, column=cython.int, sector=cython.int, on_row=cython.int,
    on_column=cython.int, found=cython.int, cell=cython.int, other=cython.int,
)
cpdef int encode_neighbours(
    const int[::1] count, const float[:, :, ::1] frame, const float[:, ::1] angle,
    const unsigned char[::1] coded, double per_px, unsigned short[:, ::1] word,
) noexcept
@cython.locals(
    p=cython.Py_ssize_t, i=cython.Py_ssize_t, k=cython.Py_ssize_t, x=cython.double, y=cython.double,
    c=cython.double, s=cython.double, side=cython.double, relative=cython.double, code=cython.int,
    row=cython.Py_ssize_t, column=cython.Py_ssize_t, rows=cython.Py_ssize_t,
    columns=cython.Py_ssize_t,
)
cpdef int encode_orientations(
    const double[:, ::1] points, const unsigned char[::1] direction_bin,
    const long long[::1] start, const unsigned char[::1] cell, const long long[::1] cell_start,
    const int[:, ::1] shape, const double[::1] step, const unsigned char[::1] has_flow,
    const double[:, ::1] places, unsigned char[:, ::1] word,
) noexcept
