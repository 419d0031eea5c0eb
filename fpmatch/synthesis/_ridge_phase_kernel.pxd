# Types of the kernel, and what other kernels may use of it.
cimport cython

@cython.locals(ax=cython.double, ay=cython.double, larger=cython.double, smaller=cython.double, t=cython.double, u=cython.double, a=cython.double, whole=cython.int)
cpdef int angle_of(double y, double x) noexcept nogil
@cython.locals(total=cython.double, k=cython.int, argument=cython.int, corner=cython.int, after=cython.int, signed=cython.int, t=cython.double, bent=cython.double)
cdef double _turning(double x, double y, double[:, ::1] points, double[::1] share, double[:, ::1] bend, int count, int omit) noexcept nogil
@cython.locals(
    rows=cython.int, columns=cython.int, b=cython.int, k=cython.int, i=cython.int, j=cython.int, corner=cython.int,
    x=cython.double, y=cython.double, opening=cython.double, at=cython.double, size=cython.double, widening=cython.double,
    wide=cython.double, above=cython.double, turn=cython.double, u=cython.double, whole=cython.int,
)
cpdef int draw_orientation(
    double[:, :, ::1] points, double[:, ::1] share, int[::1] counts, double[:, :, ::1] bend, double[::1] narrowing,
    double[:, ::1] arching, float[:, :, ::1] variation, double step, int[:, :, ::1] level,
) noexcept nogil
@cython.locals(
    angle=cython.int, other=cython.int, turned=cython.int, c=cython.double, s=cython.double, oc=cython.double,
    os=cython.double, w=cython.double, ow=cython.double, along=cython.double, whole=cython.int,
)
cdef int _advance(int[:, :, ::1] level, float[:, :, ::1] period, int b, int i, int j, int di, int dj, double step) noexcept nogil
@cython.locals(b=cython.int, sweep=cython.int)
cpdef int grow_phase(
    int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] inside, int[::1] first, int[:, :, ::1] noise, int sweeps,
    double step, int[:, :, ::1] link, int[:, :, ::1] phase,
) noexcept nogil
@cython.locals(rows=cython.int, i=cython.int, j=cython.int, k=cython.int)
cdef int _link(int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] inside, int b, double step, int[:, :, ::1] link) noexcept nogil
@cython.locals(
    rows=cython.int, back=cython.int, ii=cython.int, i=cython.int, begin=cython.int, end=cython.int, jj=cython.int,
    j=cython.int, x=cython.double, y=cython.double, side=cython.int, k=cython.int, onward=cython.int, di=cython.int,
    dj=cython.int, other=cython.int, code=cython.int, value=cython.int, at=cython.int,
)
cdef int _sweep(int[:, :, ::1] inside, int first, int[:, :, ::1] noise, int b, int sweep, int[:, :, ::1] link, int[:, :, ::1] phase) noexcept nogil
@cython.locals(b=cython.int, count=cython.int, i=cython.int, j=cython.int, begin=cython.int, end=cython.int, charge=cython.int)
cpdef int find_vortices(
    int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] inside, int[:, :, ::1] phase, double step, double spacing,
    float[:, :, :, ::1] place, double[:, :, ::1] minutia, int[::1] found,
) noexcept nogil
@cython.locals(code=cython.int, other=cython.int, rest=cython.int)
cdef int _edge(int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] phase, int b, int i, int j, int di, int dj, double step) noexcept nogil
@cython.locals(top=cython.int, left=cython.int, right=cython.int, bottom=cython.int, lower=cython.int, later=cython.int, around=cython.int)
cdef int _charge(int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] phase, int b, int i, int j, double step) noexcept nogil
@cython.locals(angle=cython.int, c=cython.double, s=cython.double, x=cython.double, y=cython.double, k=cython.int, other=cython.int, oc=cython.double, os=cython.double, sign=cython.double)
cdef int _direction(int[:, :, ::1] level, int b, int i, int j, int charge) noexcept nogil
@cython.locals(k=cython.int, i=cython.int, j=cython.int, reach=cython.double, other=cython.int, dx=cython.double, dy=cython.double, kept=cython.int, column=cython.int)
cdef int _thin_out(double[:, ::1] minutia, int count, double spacing, float[:, :, ::1] period, int b, double step) noexcept nogil
