# Types of the kernel.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid
from fpmatch.lab.points.triangles._sequential_test_kernel cimport SequentialTest

cpdef bint propose(
    SequentialTest test, Py_ssize_t[::1] order, double[:, ::1] shape_p, int[:, ::1] corner_q,
    double[::1] side_q, CellGrid shapes, double shape_tolerance, double widest, long max_proposals,
    long long max_visits, long[::1] state,
)

cdef class SimilarityTest(SequentialTest):
    cdef void _fit_corners(self, int a, int b, int c) noexcept
    cdef void _grow(self, Py_ssize_t count, double reject, double accept) noexcept
