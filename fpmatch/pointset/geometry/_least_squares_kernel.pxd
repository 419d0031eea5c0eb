# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef bint fit_lists(
    double[::1] px, double[::1] py, int[::1] p_list, Py_ssize_t p_begin, Py_ssize_t p0,
    double[::1] qx, double[::1] qy, int[::1] q_list, Py_ssize_t q_begin, Py_ssize_t q0,
    Py_ssize_t count, Py_ssize_t shift, double[::1] move,
) noexcept
cpdef bint fit_partners(
    double[:, ::1] p, CellGrid grid, int[::1] partner, double[::1] move,
) noexcept
cdef bint _fit_similarity(
    double[:, ::1] p, CellGrid grid, int[::1] partner, double px, double py, double qx, double qy,
    double[::1] move,
) noexcept
cdef bint _fit_affine(
    double[:, ::1] p, CellGrid grid, int[::1] partner, double px, double py, double qx, double qy,
    double[::1] move,
) noexcept
