# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef int assign(
    int[::1] start, int[::1] near, double[::1] cost, double least_gain, int[::1] edge,
    int[::1] owner, double[::1] path, int[:, ::1] work,
)
cpdef int find_candidates(
    double[:, ::1] p, CellGrid grid, double[::1] move, double t2, int most, int[::1] start,
    int[::1] near, double[::1] cost,
)
