# Types of the kernel.
cimport cython


@cython.locals(i=cython.Py_ssize_t, n=cython.Py_ssize_t, least=cython.longlong)
cpdef long long at_500_dpi(const float[::1] values, double zoom, long long[::1] column) noexcept nogil
@cython.locals(
    i=cython.Py_ssize_t, k=cython.Py_ssize_t, begin=cython.Py_ssize_t, bit=cython.Py_ssize_t, place=cython.int,
)
cpdef int write_columns(
    const long long[:, ::1] columns, const long long[::1] widths, unsigned char[::1] data,
) noexcept nogil
@cython.locals(
    t=cython.Py_ssize_t, i=cython.Py_ssize_t, k=cython.Py_ssize_t, begin=cython.Py_ssize_t,
    bit=cython.Py_ssize_t, value=cython.longlong, left=cython.int, place=cython.int,
    taken=cython.int, byte=cython.int,
)
cpdef int read_columns(
    const unsigned char[::1] data, const long long[::1] at, const long long[:, ::1] widths,
    const long long[::1] start, long long[:, ::1] columns,
) noexcept
@cython.locals(
    t=cython.Py_ssize_t, i=cython.Py_ssize_t, cells=cython.Py_ssize_t, width=cython.Py_ssize_t,
    row=cython.Py_ssize_t, column=cython.Py_ssize_t, place=cython.longlong,
    inside=cython.Py_ssize_t, filled=cython.Py_ssize_t, value=cython.int, top=cython.int,
    bottom=cython.int, left=cython.int, right=cython.int,
)
cpdef Py_ssize_t read_cells(
    const unsigned char[::1] data, const long long[::1] at, const long long[::1] end,
    const long long[::1] start, const long long[::1] columns, const long long[::1] cell_bytes,
    unsigned char[::1] mask, unsigned char[::1] orientation, long long[::1] after,
    unsigned char[::1] tight,
) noexcept
@cython.locals(i=cython.Py_ssize_t)
cpdef int to_image(
    const long long[::1] column, long long least, double zoom, float[::1] values,
) noexcept nogil
