# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef search(
    CellGrid p_grid, CellGrid q_grid, int[::1] pivot, int[::1] scene, int[:, ::1] near_p,
    int[:, ::1] near_q, int bases, int window, int enough_near, int enough,
    double tolerance, long long max_steps, double[::1] move, int[:, :, ::1] pair, int[::1] taken,
    long long[::1] steps, int[::1] found,
)
cpdef bint map_segment(
    CellGrid p_grid, int p, int p_base, CellGrid q_grid, int q, int q_base, double[::1] move,
) noexcept
cpdef int match_locally(
    CellGrid p_grid, int[::1] near_p, CellGrid q_grid, double[::1] move, double reach, int enough,
    int[:, ::1] pair, int[::1] taken, long long[::1] steps,
) noexcept
cpdef int match_globally(
    CellGrid p_grid, CellGrid q_grid, double tolerance, int pairs, int enough, long long max_steps,
    double[::1] move, int[:, :, ::1] pair, int[::1] taken, long long[::1] steps,
) noexcept
cpdef bint fit_pairs(
    CellGrid p_grid, CellGrid q_grid, int[:, ::1] pair, int count, double[::1] move,
) noexcept
cpdef int pair_within(
    CellGrid p_grid, CellGrid q_grid, double[::1] move, double tolerance, int enough,
    long long max_steps, int[:, ::1] pair, int[::1] taken, long long[::1] steps,
) noexcept
