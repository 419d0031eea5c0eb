# What other kernels may use of this one.
from fpmatch.matching._align_kernel cimport LightTable
from fpmatch.matching._print_kernel cimport Print
from fpmatch.matching._ridge_kernel cimport RidgeLens


cdef class Scales:
    cdef readonly double[::1] evidence, feature
    cdef double[::1] best
    cdef double[:, ::1] standard
    cdef int[::1] taken
    cdef RidgeLens lens
    cdef double most
    cdef int found
    cdef double bias, glance, glance_growth, glance_most, gate, sure, margin, doubt_pairs, doubt_cells

    cpdef double lacking(self, int weight, Py_ssize_t smaller) noexcept nogil
    cpdef double dismissed(self, double lacking) noexcept nogil
    cpdef double weigh(
        self, Print a, Print b, int[::1] partner, double[:, ::1] bent,
        double c, double s, double x, double y, float[:, ::1] likeness,
    ) noexcept nogil
    cpdef double lay(
        self, Print a, Print b, LightTable table, int[:, ::1] seeds, Py_ssize_t count,
        float[:, ::1] likeness,
    ) noexcept nogil
    cdef int _refine(
        self, Print a, Print b, LightTable table, int[:, ::1] seeds, Py_ssize_t first,
        Py_ssize_t count, Py_ssize_t best, float[:, ::1] likeness,
    ) noexcept nogil
    cdef bint _keep_better(
        self, Print a, Print b, LightTable table, float[:, ::1] likeness
    ) noexcept nogil
    cdef double _look(
        self, Print a, Print b, int[::1] partner, double c, double s, double x, double y
    ) noexcept nogil
    cpdef int describe(self) noexcept nogil
    cdef double _total(self) noexcept nogil
    cdef int _gather(
        self, Print a, Print b, int[::1] partner, double[:, ::1] bent, Py_ssize_t row,
        double c, double s, double x, double y, float[:, ::1] likeness,
    ) noexcept nogil


cdef double common_cells(Print a, Print b, double c, double s, double x, double y) noexcept nogil
cpdef double as_similarity(double total) noexcept nogil
