# Types of the kernel.
cimport cython
from fpmatch.pointset._grid_kernel cimport CellGrid
from fpmatch.pointset.triangles._sequential_test_kernel cimport SequentialTest

@cython.locals(
    o=cython.Py_ssize_t, k=cython.Py_ssize_t, e=cython.Py_ssize_t, j=cython.Py_ssize_t,
    row=cython.Py_ssize_t, begin=cython.int, end=cython.int, met=cython.long, left=cython.int, top=cython.int, right=cython.int,
    bottom=cython.int,
)
cpdef bint propose(
    SequentialTest test, Py_ssize_t[::1] order, double[:, ::1] shape_p, int[:, ::1] corner_q,
    double[::1] side_q, CellGrid shapes, double shape_tolerance, double widest, long max_proposals,
    long long max_visits, long[::1] state,
)

cdef class SimilarityTest(SequentialTest):
    @cython.locals(r=cython.Py_ssize_t, i=cython.int, j=cython.int)
    cdef void _fit_corners(self, int a, int b, int c) noexcept
    @cython.locals(n=cython.Py_ssize_t, i=cython.int, at=cython.int)
    cdef void _grow(self, Py_ssize_t count, double reject, double accept) noexcept
