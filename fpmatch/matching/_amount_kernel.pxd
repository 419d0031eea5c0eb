# Types of the kernel, and what other kernels may use of it.
cimport cython
from fpmatch.matching._template_view_kernel cimport TemplateView


cpdef double smaller_area(TemplateView a, TemplateView b) noexcept nogil
@cython.locals(
    row=cython.int, column=cython.int, cells=cython.int, place=cython.Py_ssize_t,
    at_row=cython.Py_ssize_t, at_column=cython.Py_ssize_t, bx=cython.double, by=cython.double, right=cython.double,
    down=cython.double, first_x=cython.double, first_y=cython.double, columns=cython.double,
    rows=cython.double,
)
cpdef double common_cells(TemplateView a, TemplateView b, double c, double s, double x, double y) noexcept nogil
@cython.locals(x=cython.double, y=cython.double)
cpdef int describe_amount(double minutiae, double area, double[::1] term) noexcept nogil
@cython.locals(decades=cython.double)
cpdef double most_decades(double pairs, double chance, double ridges, double cells) noexcept nogil
cpdef double poisson_decades(double count, double mean) noexcept nogil
@cython.locals(least=cython.double)
cpdef double quality_correction(double squares, double minutiae) noexcept nogil
@cython.locals(share=cython.double)
cpdef double saturated(double amount, double enough) noexcept nogil
cpdef double as_similarity(double total) noexcept nogil
