# Types of the kernel.


cpdef int restore(
    const unsigned char[::1] samples, const unsigned char[::1] orientation,
    const unsigned char[::1] mask, const long long[::1] start, const int[:, ::1] shape,
    long long[:, ::1] looked_up, const unsigned long long[:, :, :, ::1] table,
    unsigned char[::1] halves, unsigned long long[::1] ridges,
) noexcept
cdef unsigned long long _highest(unsigned long long word) noexcept nogil
