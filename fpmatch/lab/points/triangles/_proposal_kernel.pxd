# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef Py_ssize_t describe_triangles(
    double[:, ::1] point, const int[:, ::1] triangle, double near_tie, double shortest,
    double outliers, int[:, ::1] corner, double[:, ::1] shape, double[::1] side,
    double[::1] negative_information,
)

cdef class Proposals:
    cdef double[:, ::1] p, q, shape_p
    cdef int[:, ::1] corner_p, corner_q
    cdef Py_ssize_t[::1] order
    cdef const int[::1] ring_start, ring
    cdef CellGrid grid, shapes
    cdef double shape_tolerance, widest_shape, reach2, most_wider, miss, steps, accept_small, ratio
    cdef double[::1] side_q, gain, fit
    cdef public double[::1] move
    cdef int[::1] seen, neighbours
    cdef public long long tried
    cdef long long[::1] visits
    cdef Py_ssize_t place, met, k
    cdef int stamp

    cpdef bint proceed(self, long long max_tried, long long max_visits)
    cdef bint _passes(self, Py_ssize_t j, Py_ssize_t count) noexcept
    cdef Py_ssize_t _find_neighbours(self, Py_ssize_t limit) noexcept
    cdef void _fit_corners(self, Py_ssize_t t) noexcept
    cdef void _grow(self, Py_ssize_t count, double reject, double accept) noexcept
    cdef int _partner(self, double x, double y, double variance) noexcept
