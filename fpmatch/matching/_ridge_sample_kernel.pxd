# Types of the kernel.
cimport cython


@cython.locals(
    p=cython.Py_ssize_t, row=cython.Py_ssize_t, column=cython.Py_ssize_t, rows=cython.Py_ssize_t,
    columns=cython.Py_ssize_t, size=cython.Py_ssize_t, place=cython.Py_ssize_t,
    inside=cython.Py_ssize_t, filled=cython.Py_ssize_t, k=cython.Py_ssize_t, o=cython.int,
    half=cython.int, found=cython.ulonglong, m=cython.Py_ssize_t,
)
cpdef int restore(
    const unsigned char[::1] samples, const unsigned char[::1] orientation,
    const unsigned char[::1] mask, const long long[::1] start, const int[:, ::1] shape,
    long long[:, ::1] looked_up, const unsigned long long[:, :, :, ::1] table,
    unsigned char[::1] halves, unsigned long long[::1] ridges,
) noexcept
cdef unsigned long long _highest(unsigned long long word) noexcept nogil
