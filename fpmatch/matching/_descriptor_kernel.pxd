# Types of the kernel. Arrays may be mapped from a file that cannot be written.
cimport cython
from fpmatch.matching._prefilter_kernel cimport Prefilter


cdef class DescriptorReader:
    cdef const long long[::1] start
    cdef const unsigned char[::1] content, step, has_flow
    cdef const float[:, ::1] origin
    cdef readonly float[:, ::1] xy
    cdef readonly unsigned char[::1] direction_bin
    cdef readonly unsigned short[:, ::1] neighbour_bits
    cdef readonly unsigned char[:, ::1] orientation_bins

    @cython.locals(
        at=cython.Py_ssize_t, end=cython.Py_ssize_t, x=cython.double, y=cython.double,
        step=cython.double, n=cython.int, head=cython.uint, count=cython.int, i=cython.int,
    )
    cpdef int unpack(self, Py_ssize_t k) noexcept nogil
    @cython.locals(t=cython.Py_ssize_t, k=cython.Py_ssize_t, n=cython.int)
    cpdef int score(self, Prefilter tables, const long long[::1] which, int[::1] weight) noexcept nogil
    @cython.locals(found=cython.ulonglong, i=cython.int)
    cdef unsigned long long _bits(self, Py_ssize_t at, int count) noexcept nogil
    @cython.locals(last=cython.ulonglong, i=cython.int)
    cdef int _spread(self, Py_ssize_t n, unsigned long long bins) noexcept nogil
