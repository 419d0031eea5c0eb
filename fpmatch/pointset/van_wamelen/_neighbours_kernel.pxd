# What other kernels may use of this one.
from fpmatch.pointset._grid_kernel cimport CellGrid

cpdef void find_neighbours(
    CellGrid grid, int i, int[::1] near, double[::1] squared, long long[::1] steps,
) noexcept
