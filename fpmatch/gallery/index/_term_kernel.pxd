# Types of the kernel. Arrays may be mapped from a file that cannot be written.


cpdef int describe_edges(
    const double[:, ::1] points, const int[:, ::1] edge, const double[::1] curvature,
    unsigned short[::1] term, unsigned short[::1] pose,
) noexcept nogil
cpdef int measure_curvatures(
    const double[:, ::1] points, const int[:, ::1] edge, const unsigned char[:, ::1] code,
    const double[:, ::1] doubled, double step, double first_row, double first_column,
    double[::1] curvature,
) noexcept nogil
cdef int sector(double angle, int count) noexcept nogil
