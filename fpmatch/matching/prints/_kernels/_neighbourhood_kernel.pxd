# Types of the kernel.


cdef class NeighbourhoodWriter:
    cdef const double[::1] x, y, c, s
    cdef int[::1] count, joined, joined_start, met
    cdef int[:, ::1] near
    cdef float[:, :, ::1] frame
    cdef double[::1] weight, ring_weight, distance
    cdef Py_ssize_t size
    cdef double second_weight, tolerance, growth

    cpdef int write(
        self, const int[:, ::1] edge, const int[::1] start, const int[::1] ring,
        const unsigned char[::1] interior,
    ) noexcept nogil
    cdef int _join(self, const int[:, ::1] edge) noexcept nogil
    cdef int _list_nearest(self, Py_ssize_t i) noexcept nogil
    cdef bint _before(self, Py_ssize_t i, Py_ssize_t k, double squared, int j) noexcept nogil
    cdef int _write_frame(self, Py_ssize_t i, Py_ssize_t listed, double scale) noexcept nogil
