# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.pointset._grid_kernel cimport CellGrid

@cython.locals(
    count=cython.int, shell=cython.int, row=cython.int, column=cython.int, line=cython.int,
    left=cython.int, right=cython.int, step=cython.int, first=cython.int,
)
cpdef void find_neighbours(
    CellGrid grid, int i, int[::1] near, double[::1] squared, long long[::1] steps,
) noexcept
@cython.locals(j=cython.int, at=cython.int, k=cython.int)
cdef int _insert_cells(
    CellGrid grid, int i, int first, int last, int[::1] near, double[::1] squared, int count,
    long long[::1] steps,
) noexcept
cdef double _distance_outside(double value, int cell, int shell, int cells) noexcept
@cython.locals(
    i=cython.Py_ssize_t, side=cython.Py_ssize_t, count=cython.int, a=cython.int, b=cython.int,
    c=cython.int, n=cython.int,
)
cpdef double hull_area(double[:, ::1] point, int[::1] corner) noexcept
