# Types of the kernel, and what other kernels may use of it.
cimport cython


cdef class MinutiaGrid:
    cdef readonly int[::1] start, item
    cdef readonly double x0, y0, per_px, reach
    cdef readonly int columns, rows

    @cython.locals(
        j=cython.Py_ssize_t, cell=cython.Py_ssize_t, cells=cython.Py_ssize_t, filling=cython.int,
        row=cython.int, column=cython.int, first_column=cython.int, last_column=cython.int,
        first_row=cython.int, last_row=cython.int,
        x1=cython.double, y1=cython.double, side=cython.double, reach=cython.double,
    )
    cpdef int load(self, double[:, ::1] points, Py_ssize_t size) noexcept nogil
    cdef int _line(self, double place) noexcept nogil
