# Types of the kernel, and what other kernels may use of it.

cdef double _slip(double x, double y, double[::1] w) noexcept nogil
cpdef double outline_radius(double x, double y, double[::1] w) noexcept nogil
cpdef int map_corners(double[:, ::1] warp, double cell, double[:, :, :, ::1] corner) noexcept nogil
cpdef int press(
    double[:, ::1] warp, double[:, :, :, ::1] corner, double cell, float[:, :, ::1] outline, double[:, :, ::1] spots,
    float[:, :, ::1] edges, int[::1] of, double step, float[:, :, ::1] threshold, float[:, :, ::1] strength,
    float[:, :, ::1] doubt,
) noexcept nogil
cpdef int show_cells(
    double[:, :, :, ::1] corner, double cell, float[:, :, ::1] doubt, double most_doubt, int width,
    int[::1] of, double step, int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] phase,
    int[:, :, ::1] inside, int[:, :, ::1] noise, int[:, :, ::1] turn_noise, unsigned char[:, :, ::1] mask,
    float[:, :, ::1] orientation, unsigned long long[:, :, ::1] ridges,
) noexcept nogil
cdef int _level_at(double x, double y, int f, double step, int[:, :, ::1] level, int[:, :, ::1] inside) noexcept nogil
cdef int _to_image(int angle, double ax, double ay, double bx, double by) noexcept nogil
cpdef double cosine(int angle) noexcept nogil
cdef unsigned long long _picture(
    double x, double y, double ax, double ay, double bx, double by, int width, int noise, int f, double step,
    int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] phase, int[:, :, ::1] inside,
) noexcept nogil
cpdef int show_minutiae(
    double[:, ::1] warp, double[:, :, :, ::1] corner, double cell, double width, double height, double border,
    float[:, :, ::1] doubt, int[::1] of, double[:, :, ::1] minutiae, int[::1] count, float[:, :, ::1] random,
    double[::1] constants, unsigned char[:, ::1] bifurcation, double[:, :, ::1] out, int[::1] found,
) noexcept nogil
cpdef int add_spurious(
    double cell, double width, double height, double border, float[:, :, ::1] doubt, unsigned char[:, :, ::1] mask,
    float[:, :, ::1] orientation, float[:, :, :, ::1] random, double[::1] constants, double[:, :, ::1] out, int[::1] found,
) noexcept nogil
cdef double _tail(double even) noexcept nogil
cdef double _quality(double unsure, double even, double[::1] constants) noexcept nogil
