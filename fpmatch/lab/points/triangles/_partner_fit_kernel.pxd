# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef bint fit_partners(
    double[:, ::1] p, CellGrid grid, int[::1] partner, double[::1] move,
) noexcept
