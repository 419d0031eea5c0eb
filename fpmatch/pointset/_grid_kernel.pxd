# Types of the kernel, and what other kernels may use of it.
cimport cython

@cython.locals(i=cython.Py_ssize_t, finite=cython.bint)
cpdef bint bounding_box(double[:, ::1] points, double[::1] box)

cdef int _cell_at(double place, int cells) noexcept

@cython.final
cdef class CellGrid:
    cdef readonly double[::1] x, y
    cdef readonly int[::1] order, start
    cdef readonly double x0, y0, x1, y1, per_unit
    cdef readonly int columns, rows

    cdef Py_ssize_t _cell(self, double x, double y) noexcept
    cpdef (int, int, int, int) around(self, double x, double y, double reach) noexcept
    @cython.locals(
        left=cython.int, top=cython.int, right=cython.int, bottom=cython.int, row=cython.Py_ssize_t,
        k=cython.Py_ssize_t, best=cython.Py_ssize_t,
    )
    cpdef int nearest(self, double x, double y, double reach2) noexcept
    @cython.locals(
        left=cython.int, top=cython.int, right=cython.int, bottom=cython.int, row=cython.Py_ssize_t,
        k=cython.Py_ssize_t, e=cython.Py_ssize_t, found=cython.Py_ssize_t,
    )
    cpdef int within(
        self, double x, double y, double reach2, int most,
        int[::1] near, double[::1] distance2, Py_ssize_t at,
    ) noexcept
