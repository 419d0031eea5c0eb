# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.matching._pair_mesh_kernel cimport PairMesh
from fpmatch.matching._template_view_kernel cimport TemplateView


cdef class RidgeCorrelator:
    cdef readonly double correlation
    cdef readonly int cells
    cdef const unsigned long long[::1] spread, kept
    cdef const int[::1] sample_row, sample_column
    cdef double[:, ::1] offset, drift, vertex
    cdef Py_ssize_t blocks
    cdef unsigned long long[::1] ridge_image
    cdef unsigned long long[:, ::1] agreeing, wide
    cdef unsigned char[::1] both
    cdef double c, s, x, y

    cpdef int compare(
        self, TemplateView a, TemplateView b, PairMesh mesh, double c, double s, double x, double y
    ) noexcept nogil
    cpdef int compare_rigid(
        self, TemplateView a, TemplateView b, double c, double s, double x, double y
    ) noexcept nogil
    @cython.locals(
        row=cython.int, column=cython.int, found=cython.int, own=cython.Py_ssize_t,
        k=cython.Py_ssize_t, wide=cython.Py_ssize_t, px=cython.double, py=cython.double,
        half=cython.double, value=cython.double,
    )
    cpdef int copy_cells(self, TemplateView a, double[:, :, ::1] cells) noexcept
    @cython.locals(wide=cython.Py_ssize_t)
    cdef bint _take(
        self, TemplateView a, TemplateView b, double c, double s, double x, double y
    ) noexcept nogil
    @cython.locals(
        row=cython.int, column=cython.int, k=cython.Py_ssize_t, r=cython.Py_ssize_t,
        own=cython.Py_ssize_t, wide=cython.Py_ssize_t,
    )
    cdef int _correlate(self, TemplateView a, TemplateView b) noexcept nogil
    @cython.locals(k=cython.Py_ssize_t)
    cdef int _leave_in_place(self, TemplateView a) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, wide=cython.Py_ssize_t, row=cython.int, column=cython.int,
        px=cython.double, py=cython.double, bit=cython.double, per_bit=cython.double,
    )
    cdef int _gather(self, TemplateView a, TemplateView b) noexcept nogil
    @cython.locals(
        i=cython.Py_ssize_t, t=cython.Py_ssize_t, p=cython.Py_ssize_t, q=cython.Py_ssize_t,
        r=cython.Py_ssize_t, k=cython.Py_ssize_t, row=cython.int, column=cython.int,
        first_row=cython.int, last_row=cython.int, first_column=cython.int, last_column=cython.int,
        rows=cython.int, columns=cython.int, side=cython.double, left=cython.double,
        top=cython.double, px=cython.double, py=cython.double, ux=cython.double, uy=cython.double,
        vx=cython.double, vy=cython.double, area=cython.double, at_q=cython.double,
        at_r=cython.double, low=cython.double, high=cython.double,
    )
    cdef int _displace(self, TemplateView a, PairMesh mesh) noexcept nogil
    @cython.locals(origin=cython.double, place=cython.double)
    cdef double _mapped(
        self, Py_ssize_t axis, Py_ssize_t p, Py_ssize_t q, Py_ssize_t r, double at_q, double at_r
    ) noexcept nogil
    cdef int _within(self, double line, int lines) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, row=cython.int, column=cython.int, px=cython.double, py=cython.double, dx=cython.double,
        dy=cython.double, half=cython.double,
    )
    cdef int _count_block(self, TemplateView a, TemplateView b, int top, int left) noexcept nogil
    @cython.locals(
        k=cython.Py_ssize_t, wide=cython.Py_ssize_t, own=cython.Py_ssize_t, cell=cython.Py_ssize_t,
        r=cython.int, u=cython.int, v=cython.int, down=cython.int, ridges=cython.ulonglong,
        near=cython.ulonglong, far=cython.ulonglong, kept=cython.ulonglong, ones=cython.ulonglong,
        twos=cython.ulonglong, fours=cython.ulonglong, eights=cython.ulonglong,
        per_bit=cython.double, middle_u=cython.double, middle_v=cython.double, bit_u=cython.double,
        bit_v=cython.double, most_u=cython.double, most_v=cython.double,
    )
    cdef int _count(
        self, TemplateView a, TemplateView b, int row, int column, double x, double y
    ) noexcept nogil
    @cython.locals(upper=cython.ulonglong, lower=cython.ulonglong)
    cdef unsigned long long _rows_from(
        self, Py_ssize_t cell, Py_ssize_t below, int down
    ) noexcept nogil
    @cython.locals(
        r=cython.Py_ssize_t, k=cython.Py_ssize_t, around=cython.int, best=cython.int,
        count=cython.int, most=cython.ulonglong, total=cython.ulonglong, greater=cython.ulonglong,
    )
    cdef double _best_shift(self, Py_ssize_t own, Py_ssize_t wide) noexcept nogil
