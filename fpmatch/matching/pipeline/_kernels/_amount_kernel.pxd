# Types of the kernel, and what other kernels may use of it.
from fpmatch.matching.prints._kernels._template_view_kernel cimport TemplateView


cpdef double smaller_area(TemplateView a, TemplateView b) noexcept nogil
cpdef double common_cells(TemplateView a, TemplateView b, double c, double s, double x, double y) noexcept nogil
cpdef int describe_amount(double minutiae, double area, double[::1] term) noexcept nogil
cpdef double most_decades(double pairs, double chance, double ridges, double cells) noexcept nogil
cpdef double decades_beyond_chance(double pairs, double by_chance, double nearness, double ridges, double cells) noexcept nogil
cpdef double poisson_decades(double count, double mean) noexcept nogil
cpdef double quality_correction(double squares, double minutiae) noexcept nogil
cpdef double saturated(double amount, double enough) noexcept nogil
cpdef double as_similarity(double total) noexcept nogil
