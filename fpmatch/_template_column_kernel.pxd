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
    i=cython.Py_ssize_t, k=cython.Py_ssize_t, begin=cython.Py_ssize_t, bit=cython.Py_ssize_t, value=cython.longlong,
    _=cython.longlong,
)
cpdef int read_columns(
    const unsigned char[::1] data, const long long[::1] widths, long long[:, ::1] columns,
) noexcept nogil
@cython.locals(i=cython.Py_ssize_t)
cpdef int to_image(
    const long long[::1] column, long long least, double zoom, float[::1] values,
) noexcept nogil
