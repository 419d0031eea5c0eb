# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef search(
    double[:, ::1] p, CellGrid grid, int[::1] pivot, int[::1] scene, int[:, ::1] near_p,
    int[:, ::1] near_q, int bases, int window, int enough_near, int enough,
    double tolerance, long long max_steps, double[::1] move, int[::1] partner, int[::1] pair,
    int[::1] taken, int[::1] near, long long[::1] steps, int[::1] found,
)
cdef bint map_segment(
    double[:, ::1] p, int i, int i_base, CellGrid grid, int q, int q_base, double[::1] move,
) noexcept
cdef bint match_locally(
    double[:, ::1] p, int[::1] near_p, CellGrid grid, double[::1] move, double reach, int enough,
    int[::1] near, int[::1] taken, long long[::1] steps,
) noexcept
cdef int match_globally(
    double[:, ::1] p, CellGrid grid, double tolerance, int enough, long long max_steps,
    double[::1] move, int[::1] partner, int[::1] pair, int[::1] taken, long long[::1] steps,
) noexcept
cdef int pair_within(
    double[:, ::1] p, CellGrid grid, double[::1] move, double tolerance, int enough,
    long long max_steps, int[::1] pair, int[::1] taken, long long[::1] steps,
) noexcept
