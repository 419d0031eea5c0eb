# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef void find_neighbours(
    CellGrid grid, int i, int[::1] near, double[::1] squared, long long[::1] steps,
) noexcept
cdef int _insert_cells(
    CellGrid grid, int i, int first, int last, int[::1] near, double[::1] squared, int count,
    long long[::1] steps,
) noexcept
cdef double _distance_outside(double value, int cell, int shell, int cells) noexcept
cpdef double hull_area(double[:, ::1] point, int[::1] corner) noexcept
