# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cdef class SequentialTest:
    cdef double[:, ::1] p, q
    cdef int[:, ::1] corner
    cdef const int[::1] ring_start, ring
    cdef CellGrid grid
    cdef double reach2, miss, reject, accept, accept_small, steps, ratio
    cdef double[::1] gain, fit
    cdef int[::1] seen, neighbours
    cdef long long[::1] visits
    cdef Py_ssize_t test_length, k, count
    cdef int stamp

    cdef void begin(self, Py_ssize_t k) noexcept
    cdef bint passes(self, int a, int b, int c) noexcept
    cdef Py_ssize_t _find_neighbours(self, Py_ssize_t limit) noexcept
    cdef int _partner(self, double x, double y, double variance) noexcept
    cdef void _fit_corners(self, int a, int b, int c) noexcept
    cdef void _grow(self, Py_ssize_t count, double reject, double accept) noexcept

cpdef double hit_log_likelihoods(double expected, double share, double[::1] gain)
