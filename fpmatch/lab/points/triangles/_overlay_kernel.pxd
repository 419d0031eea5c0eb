# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef int refine(
    double[:, ::1] p, CellGrid grid, double t2, int max_rounds, int[::1] owner, int[::1] partner,
    double[::1] distance2, long long[::1] visits, double[::1] move,
)
cdef (double, double) _moved(double[::1] move, double x, double y) noexcept
cdef int _claim(
    CellGrid grid, double x, double y, double reach2, Py_ssize_t i, int[::1] owner,
    int[::1] partner, double[::1] distance2,
) noexcept
cpdef double log_chance(
    int[::1] partner, double[::1] distance2, int inside, double t2, double density,
    int determined=*,
)
cpdef double list_pairs(
    double[:, ::1] p, CellGrid grid, int[::1] partner, double[::1] move, int[:, ::1] pairs,
)
