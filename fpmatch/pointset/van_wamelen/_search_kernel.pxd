# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.pointset._grid_kernel cimport CellGrid

@cython.locals(
    i=cython.Py_ssize_t, j=cython.Py_ssize_t, base=cython.int, rank=cython.int, p=cython.int,
    q=cython.int, near=cython.int, k=cython.int, half=cython.int,
)
cpdef search(
    CellGrid p_grid, CellGrid q_grid, int[::1] pivot, int[::1] scene, int[::1] near_p,
    int[:, ::1] near_q, double[::1] squared, int bases, int window, int enough_near, int enough,
    double tolerance, long long max_steps, double[::1] move, int[:, :, ::1] pair, int[::1] taken,
    long long[::1] steps, int[::1] found,
)
cpdef bint map_segment(
    CellGrid p_grid, int p, int p_base, CellGrid q_grid, int q, int q_base, double[::1] move,
) noexcept
@cython.locals(i=cython.Py_ssize_t, q=cython.int, count=cython.int, k=cython.int)
cpdef int match_locally(
    CellGrid p_grid, int[::1] near_p, CellGrid q_grid, double[::1] move, double reach, int enough,
    int[:, ::1] pair, int[::1] taken, long long[::1] steps,
) noexcept
@cython.locals(i=cython.Py_ssize_t, more=cython.int, count=cython.int)
cpdef int match_globally(
    CellGrid p_grid, CellGrid q_grid, double tolerance, int pairs, int enough, long long max_steps,
    double[::1] move, int[:, :, ::1] pair, int[::1] taken, long long[::1] steps,
) noexcept
cpdef bint fit_pairs(
    CellGrid p_grid, CellGrid q_grid, int[:, ::1] pair, int count, double[::1] move,
) noexcept
@cython.locals(i=cython.Py_ssize_t, q=cython.int, count=cython.int, m=cython.int)
cpdef int pair_within(
    CellGrid p_grid, CellGrid q_grid, double[::1] move, double tolerance, int enough,
    long long max_steps, int[:, ::1] pair, int[::1] taken, long long[::1] steps,
) noexcept
