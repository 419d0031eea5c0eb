# What other kernels may use of this one.
from fpmatch.matching._print_kernel cimport Print


cdef class RidgeLens:
    cdef readonly double correlation
    cdef readonly int cells
    cdef double per_bend2, stillness
    cdef const unsigned long long[::1] lanes
    cdef unsigned long long[:, ::1] agreeing
    cdef unsigned char[::1] both
    cdef double[:, ::1] drift
    cdef double c, s, x, y

    cpdef int compare(
        self, Print a, Print b, int[::1] partner, double c, double s, double x, double y
    ) noexcept nogil
    cdef int _follow_pairs(self, Print a, Print b, int[::1] partner) noexcept nogil
    cdef int _count(self, Print a, Print b, int row, int column) noexcept nogil
    cdef double _settle(self, Print a, int row, int column) noexcept nogil
