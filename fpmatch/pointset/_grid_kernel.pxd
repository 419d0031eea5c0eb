# Types of the kernel, and what other kernels may use of it.
cimport cython

@cython.locals(i=cython.Py_ssize_t, finite=cython.bint)
cpdef bint bounding_box(double[:, ::1] points, double[::1] box)

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
    @cython.locals(
        left=cython.int, top=cython.int, right=cython.int, bottom=cython.int, row=cython.Py_ssize_t,
        cell=cython.Py_ssize_t, k=cython.Py_ssize_t, best=cython.int, begin=cython.int,
        end=cython.int,
    )
    cpdef int nearest(self, double x, double y, double reach2) noexcept
    @cython.locals(middle=cython.Py_ssize_t, k=cython.Py_ssize_t)
    cdef (int, double) _nearest_in_tree(
        self, Py_ssize_t low, Py_ssize_t high, double x, double y, int best, double reach2,
    ) noexcept
    @cython.locals(
        left=cython.int, top=cython.int, right=cython.int, bottom=cython.int, row=cython.Py_ssize_t,
        cell=cython.Py_ssize_t, k=cython.Py_ssize_t, found=cython.int, begin=cython.int,
        end=cython.int,
    )
    cpdef int within(
        self, double x, double y, double reach2, int most,
        int[::1] near, double[::1] distance2, Py_ssize_t at,
    ) noexcept
    @cython.locals(middle=cython.Py_ssize_t, k=cython.Py_ssize_t)
    cdef int _within_tree(
        self, Py_ssize_t low, Py_ssize_t high, double x, double y, double reach2, int most,
        int[::1] near, double[::1] distance2, Py_ssize_t at, int found,
    ) noexcept
    @cython.locals(e=cython.Py_ssize_t)
    cdef int _insert(
        self, Py_ssize_t k, double x, double y, double reach2, int most,
        int[::1] near, double[::1] distance2, Py_ssize_t at, int found,
    ) noexcept
    @cython.locals(cell=cython.Py_ssize_t)
    cpdef split_crowds(self)
    @cython.locals(k=cython.Py_ssize_t, middle=cython.Py_ssize_t)
    cdef void _split(self, Py_ssize_t low, Py_ssize_t high) noexcept
    @cython.locals(i=cython.Py_ssize_t, j=cython.Py_ssize_t)
    cdef void _select(
        self, Py_ssize_t low, Py_ssize_t high, Py_ssize_t middle, double[::1] value,
    ) noexcept
