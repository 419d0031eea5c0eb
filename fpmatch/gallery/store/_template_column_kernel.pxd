# Types of the kernel.


cpdef int write_columns(
    const long long[:, ::1] columns, const long long[::1] widths, unsigned char[::1] data,
) noexcept nogil
cpdef int read_columns(
    const unsigned char[::1] data, const long long[::1] at, const long long[:, ::1] widths,
    const long long[::1] start, long long[:, ::1] columns,
) noexcept
cpdef Py_ssize_t read_cells(
    const unsigned char[::1] data, const long long[::1] at, const long long[::1] end,
    const long long[::1] start, const long long[::1] columns, const long long[::1] cell_bytes,
    unsigned char[::1] mask, unsigned char[::1] orientation, long long[::1] after,
    unsigned char[::1] tight,
) noexcept
cpdef int to_image(
    const long long[::1] column, long long least, double zoom, float[::1] values,
) noexcept nogil
