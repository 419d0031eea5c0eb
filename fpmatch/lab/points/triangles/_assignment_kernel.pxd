# Types of the kernel, and what other kernels may use of it.

cpdef int assign(
    int[::1] start, int[::1] near, double[::1] cost, double least_gain, int[::1] edge,
    int[::1] owner, double[::1] path, int[:, ::1] work,
)
