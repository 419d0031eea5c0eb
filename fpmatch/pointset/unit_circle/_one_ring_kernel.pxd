# What other kernels may use of this one.
cdef bint shape_preserving_weights(
    const double[::1] px, const double[::1] py, const int[::1] vertex, Py_ssize_t begin,
    Py_ssize_t end, double x, double y, double[::1] weight,
) noexcept nogil
