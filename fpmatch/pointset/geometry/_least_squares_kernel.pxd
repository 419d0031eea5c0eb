# Types of the kernel, and what other kernels may use of it.
cpdef bint fit_lists(
    double[::1] px, double[::1] py, int[::1] p_list, Py_ssize_t p_begin, Py_ssize_t p0,
    double[::1] qx, double[::1] qy, int[::1] q_list, Py_ssize_t q_begin, Py_ssize_t q0,
    Py_ssize_t count, Py_ssize_t shift, double[::1] move,
) noexcept
