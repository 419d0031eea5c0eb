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
    double[:, ::1] arching, float[:, :, ::1] variation, int[:, :, ::1] inside, double step, int[:, :, ::1] level,
) noexcept nogil
@cython.locals(
    rows=cython.int, columns=cython.int, lanes=cython.int, sweep=cython.int, ii=cython.int, i=cython.int, jj=cython.int,
    j=cython.int, k=cython.int, p=cython.int, q=cython.int, b=cython.int, c=cython.float, s=cython.float,
    x=cython.float, y=cython.float, scale=cython.float, h=cython.float, tiny=cython.float, one=cython.float, root=cython.float, two=cython.float,
)
cpdef int grow_phase(
    float[:, :, :, ::1] normal, float[:, :, ::1] inside, float[:, :, ::1] noise, float[:, ::1] start, float step, int sweeps,
    float[:, ::1] sum_, float[:, :, :, :, ::1] link, float[:, :, :, ::1] wave,
) noexcept nogil
@cython.locals(
    lanes=cython.int, i=cython.int, j=cython.int, k=cython.int, p=cython.int, q=cython.int, b=cython.int, x=cython.float,
    y=cython.float, ox=cython.float, oy=cython.float, f=cython.float, turns=cython.float, whole=cython.int, h=cython.float,
    half=cython.float, one=cython.float, root=cython.float, two=cython.float, shift=cython.float, right=cython.float, down=cython.float,
)
cdef int _link(float[:, :, :, ::1] normal, float step, float[:, :, :, :, ::1] link) noexcept nogil
@cython.locals(u=cython.float, a=cython.float, b=cython.float, c=cython.float, d=cython.float)
cdef float _sine_of_half(float turns) noexcept nogil
@cython.locals(
    rows=cython.int, b=cython.int, i=cython.int, j=cython.int, k=cython.int, p=cython.int, q=cython.int, t=cython.double,
    rest=cython.double, count=cython.int, begin=cython.int, end=cython.int, top=cython.float, left=cython.float,
    around=cython.double, charge=cython.int,
)
cpdef int find_vortices(
    int[:, :, ::1] level, float[:, :, ::1] period, int[:, :, ::1] inside, float[:, :, :, :, ::1] link,
    float[:, :, :, ::1] wave, double step, double spacing, float[:, :, :, ::1] place, int[:, :, ::1] phase,
    double[:, :, ::1] turns, double[:, :, ::1] minutia, int[::1] found,
) noexcept nogil
@cython.locals(angle=cython.int, c=cython.double, s=cython.double, x=cython.double, y=cython.double, k=cython.int, other=cython.int, oc=cython.double, os=cython.double, sign=cython.double)
cdef int _direction(int[:, :, ::1] level, int b, int i, int j, int charge) noexcept nogil
@cython.locals(k=cython.int, i=cython.int, j=cython.int, reach=cython.double, other=cython.int, dx=cython.double, dy=cython.double, kept=cython.int, column=cython.int)
cdef int _thin_out(double[:, ::1] minutia, int count, double spacing, float[:, :, ::1] period, int b, double step) noexcept nogil
