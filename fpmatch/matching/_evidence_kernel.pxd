# What other kernels may use of this one.
from fpmatch.matching._print_kernel cimport Print

cpdef int gather(
    Print a, Print b, int[::1] partner, double[:, ::1] bent, double c, double s, double x, double y,
    float[:, ::1] likeness, double doubt, double unknown, int[::1] taken, double[::1] evidence,
) noexcept nogil
cpdef double ring_agreement(Print a, Print b, int[::1] partner) noexcept nogil
cpdef int field_agreement(
    Print a, Print b, double c, double s, double x, double y, double[::1] evidence
) noexcept nogil
cpdef double weigh(double[::1] evidence, double[::1] parameters) noexcept nogil
