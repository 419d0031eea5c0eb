# Types of the kernel.
cimport cython
@cython.locals(
    i=cython.Py_ssize_t, m=cython.Py_ssize_t, begin=cython.Py_ssize_t, end=cython.Py_ssize_t,
    following=cython.Py_ssize_t, last=cython.Py_ssize_t, x=cython.double, y=cython.double,
    c=cython.double, s=cython.double, dx=cython.double, dy=cython.double, angle=cython.double,
    largest=cython.double, rise=cython.double, share=cython.double, around=cython.double,
    anchor=cython.double,
)
cpdef void map_to_circle(
    const double[:, ::1] points, const int[::1] centre, const int[::1] start,
    const int[::1] vertex, double[:, ::1] circle,
) except *
@cython.locals(
    n=cython.Py_ssize_t, size=cython.Py_ssize_t, i=cython.Py_ssize_t, e=cython.Py_ssize_t,
    f=cython.Py_ssize_t, k=cython.Py_ssize_t, j=cython.int, via=cython.int, listed=cython.int,
    dx=cython.double, dy=cython.double, c=cython.double, s=cython.double, squared=cython.double,
    total=cython.double, tolerance=cython.double, degree=cython.double,
    joined_start=cython.int[::1], joined=cython.int[::1], met=cython.int[::1],
    weight=cython.double[::1], distance=cython.double[::1],
)
cpdef void nearest_in_own_frames(
    const double[:, ::1] points, const int[:, ::1] edge, const int[::1] start,
    const int[::1] ring, const double[::1] ring_weight, double second_weight,
    double tolerance_px, double growth, int[::1] count, int[:, ::1] near,
    float[:, :, ::1] frame,
) except *
