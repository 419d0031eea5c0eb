# What other kernels may use of this one.
from fpmatch.matching._print_kernel cimport Print

cpdef int gather(
    Print a, Print b, int[::1] partner, double[:, ::1] bent, double c, double s, double x, double y,
    float[:, ::1] likeness, double margin, double doubt_cells, double doubt_change,
    int[::1] scratch, double[::1] evidence,
) noexcept nogil
cpdef int field_agreement(
    Print a, Print b, double c, double s, double x, double y, double doubt_cells,
    double doubt_change, int[::1] above, double[::1] evidence,
) noexcept nogil
cpdef int describe(
    double[::1] evidence, double doubt_pairs, double doubt_area, double least_roughness,
    double[::1] feature,
) noexcept nogil
cpdef double weigh(
    double[::1] evidence, double doubt_pairs, double doubt_area, double least_roughness,
    double[:, ::1] standard, double bias, double[::1] feature,
) noexcept nogil
