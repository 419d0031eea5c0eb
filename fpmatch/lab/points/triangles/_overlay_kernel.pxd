# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef int refine(
    double[:, ::1] p, CellGrid grid, double t2, int max_rounds, int[::1] owner, int[::1] partner,
    double[::1] distance2, long long[::1] visits, double[::1] move,
)
cdef int _claim(
    CellGrid grid, double x, double y, double reach2, Py_ssize_t i, int[::1] owner,
    int[::1] partner, double[::1] distance2,
) noexcept
cpdef void pair_by_auction(
    double[:, ::1] p, CellGrid grid, double[::1] move, double t2, int[::1] owner,
    int[::1] partner,
)
cpdef bint fit_partners(
    double[:, ::1] p, CellGrid grid, int[::1] partner, double[::1] move,
) noexcept
