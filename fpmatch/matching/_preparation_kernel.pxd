# Types of the kernel.
cimport cython


@cython.locals(
    rows=cython.Py_ssize_t, columns=cython.Py_ssize_t, row=cython.Py_ssize_t, top=cython.Py_ssize_t,
    bottom=cython.Py_ssize_t, left=cython.Py_ssize_t, right=cython.Py_ssize_t,
    first=cython.Py_ssize_t, last=cython.Py_ssize_t,
)
cpdef int box_of(const unsigned char[:, ::1] mask, long long[::1] box) noexcept nogil
@cython.locals(i=cython.Py_ssize_t, step=cython.longlong)
cpdef int write_codes(
    const double[::1] orientation, const unsigned char[::1] mask, double per_radian,
    unsigned char[::1] code,
) noexcept nogil
@cython.locals(
    k=cython.Py_ssize_t, i=cython.Py_ssize_t, total=cython.longlong, given=cython.bint,
)
cpdef int write_qualities(
    const unsigned char[::1] quality, const long long[::1] start, double usual, double[::1] found,
) noexcept nogil
@cython.locals(i=cython.Py_ssize_t, k=cython.Py_ssize_t, step=cython.double)
cpdef int round_weights(float[:, :] root_weight, unsigned char[:, ::1] code) noexcept nogil
