# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.pointset._grid_kernel cimport CellGrid

@cython.locals(i=cython.Py_ssize_t, e=cython.Py_ssize_t)
cpdef int find_candidates(
    double[:, ::1] p, CellGrid grid, double[::1] move, double t2, int most, int[::1] start,
    int[::1] near, double[::1] cost,
)
@cython.locals(
    size=cython.Py_ssize_t, s=cython.Py_ssize_t, e=cython.Py_ssize_t, head=cython.Py_ssize_t,
    waiting=cython.Py_ssize_t, tail=cython.Py_ssize_t, i=cython.int, j=cython.int, k=cython.int,
    visits=cython.longlong, most=cython.longlong, last=cython.longlong,
    end=cython.int, end_edge=cython.int, assigned=cython.int, came_from=cython.int[::1],
    came_by=cython.int[::1], stamp=cython.int[::1], queue=cython.int[::1], waits=cython.int[::1],
)
cpdef int assign(
    int[::1] start, int[::1] near, double[::1] cost, double least_gain, int[::1] edge,
    int[::1] owner, double[::1] path, int[:, ::1] work,
)
