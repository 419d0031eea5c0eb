# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.pointset._grid_kernel cimport CellGrid

cdef double WIDEST

@cython.locals(
    o=cython.Py_ssize_t, k=cython.Py_ssize_t, e=cython.Py_ssize_t, j=cython.Py_ssize_t,
    row=cython.Py_ssize_t, met=cython.long, count=cython.Py_ssize_t, left=cython.int,
    top=cython.int, right=cython.int, bottom=cython.int, stamp=cython.int,
)
cpdef bint propose(
    double[:, ::1] p, Py_ssize_t[::1] order, int[:, ::1] corner_p, double[:, ::1] shape_p,
    const int[::1] ring_start, const int[::1] ring, double[:, ::1] q, CellGrid grid,
    int[:, ::1] corner_q, double[::1] side_q, CellGrid shapes, double shape_tolerance,
    double widest, double reach2, double[::1] gain, double miss, double reject, double accept,
    double accept_small, Py_ssize_t test_length, int[::1] seen, int[::1] neighbours,
    long max_proposals, double[::1] fit, long[::1] state,
)
@cython.locals(n=cython.Py_ssize_t, at=cython.Py_ssize_t, e=cython.Py_ssize_t, i=cython.int)
cdef Py_ssize_t find_neighbours(
    int[:, ::1] corner, Py_ssize_t k, const int[::1] ring_start, const int[::1] ring, int[::1] seen,
    int stamp, Py_ssize_t limit, int[::1] neighbours,
) noexcept
@cython.locals(r=cython.Py_ssize_t)
cdef void _fit_corners(
    double[:, ::1] p, int[:, ::1] corner_p, Py_ssize_t k, double[:, ::1] q, int[:, ::1] corner_q,
    Py_ssize_t j, double[::1] fit,
) noexcept
@cython.locals(n=cython.Py_ssize_t, i=cython.int, at=cython.int, step=cython.Py_ssize_t)
cdef double _grow(
    double[:, ::1] p, CellGrid grid, int[::1] neighbours, Py_ssize_t count, double reach2,
    double[::1] gain, double miss, double reject, double accept, double[::1] fit,
) noexcept
@cython.locals(k=cython.Py_ssize_t, steps=cython.double)
cpdef double hit_log_likelihoods(double expected, double share, double[::1] gain)
