# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

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
