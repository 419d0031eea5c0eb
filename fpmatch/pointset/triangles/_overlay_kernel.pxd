# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.pointset._grid_kernel cimport CellGrid

@cython.locals(
    i=cython.Py_ssize_t, round_=cython.int, pairs=cython.int, before=cython.int, inside=cython.int,
)
cpdef int refine(
    double[:, ::1] p, CellGrid grid, double t2, int max_rounds, int[::1] owner, int[::1] partner,
    double[::1] distance2, long long[::1] visits, double[::1] move,
)
cdef (double, double) _moved(double[::1] move, double x, double y) noexcept
@cython.locals(at=cython.int, held=cython.int)
cdef int _claim(
    CellGrid grid, double x, double y, double reach2, Py_ssize_t i, int[::1] owner,
    int[::1] partner, double[::1] distance2,
) noexcept
@cython.locals(i=cython.Py_ssize_t, part=cython.int, pairs=cython.int, trials=cython.double)
cpdef double log_chance(
    int[::1] partner, double[::1] distance2, int inside, double t2, double density,
    int determined=*,
)
@cython.locals(i=cython.Py_ssize_t, at=cython.int, count=cython.Py_ssize_t)
cpdef double list_pairs(
    double[:, ::1] p, CellGrid grid, int[::1] partner, double[::1] move, int[:, ::1] pairs,
)
