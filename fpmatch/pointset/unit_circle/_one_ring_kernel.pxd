# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.pointset._grid_kernel cimport CellGrid

@cython.locals(i=cython.Py_ssize_t, line=cython.Py_ssize_t)
cpdef centre_images(
    const double[:, ::1] point, int[::1] centre, int[::1] start, int[::1] vertex,
    double[:, ::1] circle, double[::1] weight, double[:, ::1] image,
)
@cython.locals(
    line=cython.Py_ssize_t, r=cython.Py_ssize_t, s=cython.Py_ssize_t, far=cython.Py_ssize_t,
    first=cython.Py_ssize_t, degree=cython.double,
)
cdef bint shape_preserving_weights(
    const double[::1] px, const double[::1] py, const int[::1] vertex, Py_ssize_t begin,
    Py_ssize_t end, double x, double y, double[::1] weight,
) noexcept nogil
@cython.locals(
    k=cython.Py_ssize_t, a=cython.Py_ssize_t, b=cython.Py_ssize_t, degree=cython.Py_ssize_t,
    shift=cython.Py_ssize_t, px=cython.double[::1], py=cython.double[::1], qx=cython.double[::1],
    qy=cython.double[::1],
)
cpdef fit_ring_pairs(
    int[:, ::1] pair, double[:, ::1] p_point, int[::1] p_centre, int[::1] p_start,
    int[::1] p_vertex, double[:, ::1] p_circle, double[:, ::1] p_image, double[:, ::1] q_point,
    int[::1] q_centre, int[::1] q_start, int[::1] q_vertex, double[:, ::1] q_circle,
    double[:, ::1] q_image, double[:, ::1] move,
)
@cython.locals(
    j=cython.Py_ssize_t, m=cython.Py_ssize_t, shift=cython.Py_ssize_t, best=cython.Py_ssize_t,
)
cdef Py_ssize_t _best_shift(
    double[:, ::1] p_circle, double[:, ::1] p_image, Py_ssize_t p_begin, Py_ssize_t a,
    double[:, ::1] q_circle, double[:, ::1] q_image, Py_ssize_t q_begin, Py_ssize_t b,
    Py_ssize_t degree,
) noexcept
@cython.locals(
    k=cython.Py_ssize_t, i=cython.Py_ssize_t, j=cython.Py_ssize_t, row=cython.Py_ssize_t,
    n=cython.int, met_p=cython.int, met_q=cython.int, near=cython.int, left=cython.int,
    crowded=cython.bint,
    top=cython.int, right=cython.int, bottom=cython.int,
)
cpdef best_overlay(
    double[:, ::1] move, double[:, ::1] p_point, CellGrid grid, double tolerance, int enough,
    int[::1] last_met, int[::1] found,
)
