# Types of the kernel, and what other kernels may use of it.

cpdef Py_ssize_t describe_triangles(
    double[:, ::1] point, const int[:, ::1] triangle, double near_tie, double shortest,
    double outliers, int[:, ::1] corner, double[:, ::1] shape, double[::1] side,
    double[::1] negative_information,
)
cpdef Py_ssize_t ring_triangles(
    double[:, ::1] point, const int[::1] ring_start, const int[::1] ring, Py_ssize_t reach,
    int[:, ::1] triangle,
)
cdef bint _joined(const int[::1] ring_start, const int[::1] ring, int j, int k) noexcept
cpdef double polygon_area(double[:, ::1] point, const int[::1] corner)
cpdef void triangle_areas(double[:, ::1] point, const int[:, ::1] triangle, double[::1] area)
cpdef void nearest_two(
    double[:, ::1] point, const int[::1] ring_start, const int[::1] ring, double[::1] first2,
    double[::1] second2,
)
cpdef Py_ssize_t longest_run(double[::1] ordered, double alike)
