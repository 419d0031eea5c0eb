# What other kernels may use of this one.
from fpmatch.matching._pair_mesh_kernel cimport PairMesh
from fpmatch.matching._template_view_kernel cimport Print


cdef class RidgeCorrelator:
    cdef readonly double correlation
    cdef readonly int cells
    cdef const unsigned long long[::1] spread, kept
    cdef const int[::1] sample_row, sample_column
    cdef double[:, ::1] offset, drift, vertex
    cdef Py_ssize_t blocks
    cdef unsigned long long[::1] picture
    cdef unsigned long long[:, ::1] agreeing, wide
    cdef unsigned char[::1] both
    cdef double c, s, x, y

    cpdef int compare(
        self, Print a, Print b, PairMesh mesh, double c, double s, double x, double y
    ) noexcept nogil
    cpdef int compare_rigid(
        self, Print a, Print b, double c, double s, double x, double y
    ) noexcept nogil
    cdef bint _take(
        self, Print a, Print b, double c, double s, double x, double y
    ) noexcept nogil
    cdef int _correlate(self, Print a, Print b) noexcept nogil
    cdef int _leave_in_place(self, Print a) noexcept nogil
    cdef int _gather(self, Print a, Print b) noexcept nogil
    cdef int _displace(self, Print a, PairMesh mesh) noexcept nogil
    cdef int _within(self, double line, int lines) noexcept nogil
    cdef int _count_block(self, Print a, Print b, int top, int left) noexcept nogil
    cdef int _count(
        self, Print a, Print b, int row, int column, double x, double y
    ) noexcept nogil
    cdef double _settle(self, Py_ssize_t own, Py_ssize_t wide) noexcept nogil
