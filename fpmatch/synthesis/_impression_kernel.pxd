# Types of the kernel, and what other kernels may use of it.
cimport cython

@cython.locals(ux=cython.double, uy=cython.double, slip=cython.double, t=cython.double, s=cython.double)
cdef double _slip(double x, double y, double[::1] w) noexcept nogil
@cython.locals(
    across=cython.double, along=cython.double, larger=cython.double, smaller=cython.double, at=cython.double,
    step=cython.int, t=cython.double, table="double[::1]",
)
cpdef double outline_radius(double x, double y, double[::1] w) noexcept nogil
@cython.locals(
    b=cython.int, i=cython.int, j=cython.int, x=cython.double, y=cython.double, slip=cython.double, ax=cython.double,
    ay=cython.double, w="double[::1]",
)
cpdef int map_corners(double[:, ::1] warp, double cell, double[:, :, :, ::1] corner) noexcept nogil
@cython.locals(
    b=cython.int, i=cython.int, j=cython.int, k=cython.int, row=cython.int, x=cython.double, y=cython.double,
    mx=cython.double, my=cython.double, dx=cython.double, dy=cython.double, out=cython.double, value=cython.double,
    w="double[::1]",
)
cpdef int press(
    double[:, ::1] warp, double[:, :, :, ::1] corner, double cell, float[:, :, ::1] outline, double[:, :, ::1] spots,
    float[:, :, ::1] edges, int[::1] of, double step, float[:, :, ::1] threshold, float[:, :, ::1] strength,
    float[:, :, ::1] doubt,
) noexcept nogil
@cython.locals(
    b=cython.int, f=cython.int, i=cython.int, j=cython.int, x=cython.double, y=cython.double, ax=cython.double,
    ay=cython.double, bx=cython.double, by=cython.double, angle=cython.int, turned=cython.int,
)
cpdef int show_cells(
    double[:, :, :, ::1] corner, double cell, float[:, :, ::1] doubt, double most_doubt, int width,
    int[::1] of, double step, int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] phase,
    int[:, :, ::1] inside, int[:, :, ::1] noise, int[:, :, ::1] turn_noise, unsigned char[:, :, ::1] mask,
    float[:, :, ::1] orientation, unsigned long long[:, :, ::1] ridges,
) noexcept nogil
@cython.locals(i=cython.int, j=cython.int)
cdef int _level_at(double x, double y, int f, double step, int[:, :, ::1] level, int[:, :, ::1] inside) noexcept nogil
@cython.locals(c=cython.double, s=cython.double, x=cython.double, y=cython.double)
cdef int _to_image(int angle, double ax, double ay, double bx, double by) noexcept nogil
@cython.locals(whole=cython.int, t=cython.double, u=cython.double)
cpdef double cosine(int angle) noexcept nogil
@cython.locals(
    bits="unsigned long long", hit="unsigned long long", quarter=cython.int, row=cython.int, column=cython.int, mx=cython.double, my=cython.double,
    i=cython.int, j=cython.int, angle=cython.int, per_px=cython.double, kx=cython.double, ky=cython.double,
    here=cython.int, across=cython.int, down=cython.int, k=cython.int, at=cython.int, part=cython.int,
)
cdef unsigned long long _picture(
    double x, double y, double ax, double ay, double bx, double by, int width, int noise, int f, double step,
    int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] phase, int[:, :, ::1] inside,
) noexcept nogil
@cython.locals(
    b=cython.int, f=cython.int, n=cython.int, k=cython.int, i=cython.int, j=cython.int, whole=cython.int, _=cython.int,
    mx=cython.double, my=cython.double, gx=cython.double, gy=cython.double, x=cython.double, y=cython.double,
    slip=cython.double, ax=cython.double, ay=cython.double, bx=cython.double, by=cython.double, unsure=cython.double,
    missed=cython.double, spread=cython.double, turned=cython.double, flipped=cython.bint, w="double[::1]", r="float[::1]",
)
cpdef int show_minutiae(
    double[:, ::1] warp, double[:, :, :, ::1] corner, double cell, double width, double height, double border,
    float[:, :, ::1] doubt, int[::1] of, double[:, :, ::1] minutiae, int[::1] count, float[:, :, ::1] random,
    double[::1] constants, unsigned char[:, ::1] bifurcation, double[:, :, ::1] out, int[::1] found,
) noexcept nogil
@cython.locals(
    b=cython.int, n=cython.int, i=cython.int, j=cython.int, unsure=cython.double, x=cython.double, y=cython.double,
    turned=cython.double, along=cython.double, gap=cython.double, end=cython.int, r="float[::1]",
)
cpdef int add_spurious(
    double cell, double width, double height, double border, float[:, :, ::1] doubt, unsigned char[:, :, ::1] mask,
    float[:, :, ::1] orientation, float[:, :, :, ::1] random, double[::1] constants, double[:, :, ::1] out, int[::1] found,
) noexcept nogil
cdef double _tail(double even) noexcept nogil
@cython.locals(quality=cython.double)
cdef double _quality(double unsure, double even, double[::1] constants) noexcept nogil
