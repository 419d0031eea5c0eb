# What other kernels may use of this one.
cdef class CellGrid:
    cdef readonly double[::1] x, y
    cdef readonly int[::1] order, start
    cdef readonly double x0, y0, x1, y1, per_unit
    cdef readonly int columns, rows

    cdef Py_ssize_t _cell(self, double x, double y) noexcept
    cpdef int nearest(self, double x, double y, double reach2) noexcept
    cpdef int column(self, double x) noexcept
    cpdef int row(self, double y) noexcept
    cpdef int within(
        self, double x, double y, double reach2, int most,
        int[::1] near, double[::1] distance2, Py_ssize_t at,
    ) noexcept
