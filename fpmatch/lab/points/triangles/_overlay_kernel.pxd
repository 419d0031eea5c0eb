# Types of the kernel, and what other kernels may use of it.
from fpmatch.pointset.geometry._grid_kernel cimport CellGrid

cpdef int refine(
    double[:, ::1] p, CellGrid grid, double t2, int max_rounds, int[::1] owner, int[::1] partner,
    double[::1] distance2, long long[::1] visits, double[::1] move,
)
cdef (double, double) _moved(double[::1] move, double x, double y) noexcept
cdef int _claim(
    CellGrid grid, double x, double y, double reach2, Py_ssize_t i, int[::1] owner,
    int[::1] partner, double[::1] distance2,
) noexcept
cpdef double log_chance(
    int[::1] partner, double[::1] distance2, int inside, double t2, double[::1] rate,
)
cpdef double list_pairs(
    double[:, ::1] p, CellGrid grid, int[::1] partner, double[::1] move, int[:, ::1] pairs,
)
cpdef void uniform_rates(double density, double t2, double[::1] rate)
cpdef int local_rates(
    double[:, ::1] p, CellGrid grid, double[::1] move, int[::1] partner, int every, double reach2,
    double t2, int[::1] near, double[::1] distance2, double[:, ::1] each, double[::1] rate,
)
cpdef int rival_moves(
    double[:, ::1] p, CellGrid grid, int[::1] partner, Py_ssize_t i, Py_ssize_t best,
    double[:, ::1] q, const int[::1] q_ring_start, const int[::1] q_ring, double[::1] move,
    Py_ssize_t shifts, double within, double[::1] apart, double[:, ::1] moves, int first,
)
cpdef bint has_rival(
    double[:, ::1] p, CellGrid grid, double t2, double[::1] rate, double needed,
    double[:, ::1] moves, int[::1] known, int[::1] owner, int[::1] partner, double[::1] distance2,
    long long[::1] visits,
)
