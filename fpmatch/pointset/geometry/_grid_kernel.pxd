# Types of the kernel, and what other kernels may use of it.
cimport cython

cdef int _cell_at(double place, int cells) noexcept

@cython.final
cdef class CellGrid:
    cdef readonly double[::1] x, y
    cdef readonly int[::1] order, start
    cdef readonly unsigned char[::1] axis
    cdef readonly double x0, y0, x1, y1, per_unit
    cdef readonly int columns, rows

    cdef Py_ssize_t _cell(self, double x, double y) noexcept
    cpdef (int, int, int, int) around(self, double x, double y, double reach) noexcept
    cpdef int nearest(self, double x, double y, double reach2) noexcept
    cdef (int, double) _nearest_in_tree(
        self, Py_ssize_t low, Py_ssize_t high, double x, double y, int best, double reach2,
    ) noexcept
    cpdef int within(
        self, double x, double y, double reach2, int most,
        int[::1] near, double[::1] distance2, Py_ssize_t at,
    ) noexcept
    cdef int _within_tree(
        self, Py_ssize_t low, Py_ssize_t high, double x, double y, double reach2, int most,
        int[::1] near, double[::1] distance2, Py_ssize_t at, int found,
    ) noexcept
    cdef int _insert(
        self, Py_ssize_t k, double x, double y, double reach2, int most,
        int[::1] near, double[::1] distance2, Py_ssize_t at, int found,
    ) noexcept
    cpdef split_crowds(self)
