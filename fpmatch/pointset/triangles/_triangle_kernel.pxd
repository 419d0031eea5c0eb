# Types of the kernel, and what other kernels may use of it.
cimport cython

@cython.locals(
    k=cython.Py_ssize_t, i=cython.Py_ssize_t, r=cython.Py_ssize_t, a=cython.int, b=cython.int,
    c=cython.int,
)
cpdef Py_ssize_t describe_triangles(
    double[:, ::1] point, const int[:, ::1] triangle, double near_tie, double shortest,
    double outliers, int[:, ::1] corner, double[:, ::1] shape, double[::1] side,
    double[::1] negative_information,
)
@cython.locals(
    count=cython.Py_ssize_t, i=cython.Py_ssize_t, e=cython.Py_ssize_t, apart=cython.Py_ssize_t,
    degree=cython.Py_ssize_t, j=cython.int, k=cython.int,
)
cpdef Py_ssize_t ring_triangles(
    double[:, ::1] point, const int[::1] ring_start, const int[::1] ring, Py_ssize_t reach,
    int[:, ::1] triangle,
)
@cython.locals(d=cython.Py_ssize_t, joined=cython.bint)
cdef bint _joined(const int[::1] ring_start, const int[::1] ring, int j, int k) noexcept
@cython.locals(e=cython.Py_ssize_t, a=cython.int, b=cython.int)
cpdef double polygon_area(double[:, ::1] point, const int[::1] corner)
@cython.locals(i=cython.Py_ssize_t, a=cython.int, b=cython.int, c=cython.int)
cpdef void triangle_areas(double[:, ::1] point, const int[:, ::1] triangle, double[::1] area)
