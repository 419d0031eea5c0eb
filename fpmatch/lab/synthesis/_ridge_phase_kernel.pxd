# Types of the kernel, and what other kernels may use of it.

cpdef int angle_of(double y, double x) noexcept nogil
cdef double _turning(double x, double y, double[:, ::1] points, double[::1] share, double[:, ::1] bend, int count, int omit) noexcept nogil
cpdef int draw_orientation(
    double[:, :, ::1] points, double[:, ::1] share, int[::1] counts, double[:, :, ::1] bend, double[::1] narrowing,
    double[:, ::1] arching, float[:, :, ::1] variation, int[:, :, ::1] inside, double step, int[:, :, ::1] level,
) noexcept nogil
cpdef int grow_phase(
    float[:, :, :, ::1] normal, float[:, :, ::1] inside, float[:, :, ::1] noise, float[:, ::1] start, float step, int sweeps,
    float[:, ::1] sum_, float[:, :, :, :, ::1] link, float[:, :, :, ::1] wave,
) noexcept nogil
cdef int _link(float[:, :, :, ::1] normal, float step, float[:, :, :, :, ::1] link) noexcept nogil
cdef float _sine_of_half(float turns) noexcept nogil
cpdef int find_vortices(
    int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] inside, float[:, :, :, :, ::1] link,
    float[:, :, :, ::1] wave, double step, double spacing, float[:, :, :, ::1] place, int[:, :, ::1] phase,
    double[:, :, ::1] turns, double[:, :, ::1] minutia, int[::1] found,
) noexcept nogil
cdef int _direction(int[:, :, ::1] level, int b, int i, int j, int charge) noexcept nogil
cdef int _thin_out(double[:, ::1] minutia, int count, double spacing, float[:, :, ::1] period, int b, double step) noexcept nogil
