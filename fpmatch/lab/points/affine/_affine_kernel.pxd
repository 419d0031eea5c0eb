# Types of the kernel.
from fpmatch.lab.points.triangles._sequential_test_kernel cimport SequentialTest

cpdef bint propose(
    SequentialTest test, double[:, ::1] p, Py_ssize_t[::1] order, int[:, ::1] corner_p,
    int[:, ::1] corner_q, double[:, ::1] wide_q, double max_anisotropy, double least_area,
    double most_area, long max_proposals, long long max_visits, long[::1] state,
)

cdef class AffineTest(SequentialTest):
    cdef void _fit_corners(self, int a, int b, int c) noexcept
    cdef void _grow(self, Py_ssize_t count, double reject, double accept) noexcept

cpdef void move_of(double[::1] fit, double[::1] move)
