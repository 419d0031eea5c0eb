# Types of the kernel.
cimport cython
from fpmatch.pointset.triangles._sequential_test_kernel cimport SequentialTest

@cython.locals(
    o=cython.Py_ssize_t, k=cython.Py_ssize_t, j=cython.Py_ssize_t, r=cython.Py_ssize_t,
    a=cython.int, b=cython.int, c=cython.int, met=cython.Py_ssize_t, many=cython.Py_ssize_t,
)
cpdef bint propose(
    SequentialTest test, double[:, ::1] p, Py_ssize_t[::1] order, int[:, ::1] corner_p,
    int[:, ::1] corner_q, double[:, ::1] wide_q, double max_anisotropy, double least_area,
    double most_area, long max_proposals, long long max_visits, long[::1] state,
)

cdef class AffineTest(SequentialTest):
    @cython.locals(r=cython.Py_ssize_t, i=cython.int, j=cython.int, k=cython.int)
    cdef void _fit_corners(self, int a, int b, int c) noexcept
    @cython.locals(n=cython.Py_ssize_t, i=cython.int, at=cython.int)
    cdef void _grow(self, Py_ssize_t count, double reject, double accept) noexcept

@cython.locals(r=cython.Py_ssize_t)
cpdef void move_of(double[::1] fit, double[::1] move)
