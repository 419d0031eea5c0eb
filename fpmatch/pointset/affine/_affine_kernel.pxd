# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.pointset._grid_kernel cimport CellGrid

@cython.locals(
    o=cython.Py_ssize_t, k=cython.Py_ssize_t, j=cython.Py_ssize_t, r=cython.Py_ssize_t,
    a=cython.int, b=cython.int, c=cython.int, met=cython.Py_ssize_t, many=cython.Py_ssize_t,
    count=cython.Py_ssize_t, stamp=cython.int,
)
cpdef bint propose(
    double[:, ::1] p, Py_ssize_t[::1] order, int[:, ::1] corner_p, const int[::1] ring_start,
    const int[::1] ring, double[:, ::1] q, CellGrid grid, int[:, ::1] corner_q,
    double[:, ::1] wide_q, double max_anisotropy, double least_area,
    double most_area, double reach2, double[::1] gain, double miss,
    double reject, double accept, double accept_small, Py_ssize_t test_length, int[::1] seen,
    int[::1] neighbours, long max_proposals, double[::1] fit, long[::1] state,
)
@cython.locals(r=cython.Py_ssize_t, i=cython.int)
cdef void _fit_corners(
    double[:, ::1] p, int[:, ::1] corner_p, Py_ssize_t k, double[:, ::1] q, int a, int b, int c,
    double[::1] fit,
) noexcept
@cython.locals(n=cython.Py_ssize_t, i=cython.int, at=cython.int, step=cython.Py_ssize_t)
cdef double _grow(
    double[:, ::1] p, CellGrid grid, int[::1] neighbours, Py_ssize_t count, double reach2,
    double[::1] gain, double miss, double reject, double accept, double[::1] fit,
) noexcept
@cython.locals(r=cython.Py_ssize_t)
cpdef void move_of(double[::1] fit, double[::1] move)
