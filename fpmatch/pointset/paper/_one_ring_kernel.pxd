# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef centre_images(
    const double[:, ::1] point, int[::1] centre, int[::1] start, int[::1] vertex,
    double[:, ::1] circle, double[::1] weight, double[:, ::1] image,
)
cdef bint shape_preserving_weights(
    const double[::1] px, const double[::1] py, const int[::1] vertex, Py_ssize_t begin,
    Py_ssize_t end, double x, double y, double[::1] weight,
) noexcept nogil
cpdef fit_ring_pairs(
    int[:, ::1] pair, double[:, ::1] p_point, int[::1] p_centre, int[::1] p_start,
    int[::1] p_vertex, double[:, ::1] p_circle, double[:, ::1] p_image, double[:, ::1] q_point,
    int[::1] q_centre, int[::1] q_start, int[::1] q_vertex, double[:, ::1] q_circle,
    double[:, ::1] q_image, double[:, ::1] move,
)
cdef Py_ssize_t _best_shift(
    double[:, ::1] p_circle, double[:, ::1] p_image, Py_ssize_t p_begin, Py_ssize_t a,
    double[:, ::1] q_circle, double[:, ::1] q_image, Py_ssize_t q_begin, Py_ssize_t b,
    Py_ssize_t degree,
) noexcept
cpdef best_overlay(
    double[:, ::1] move, double[:, ::1] p_point, CellGrid grid, double tolerance, int enough,
    int[::1] last_met, int[::1] found,
)
