# Types of the kernel.


cpdef int box_of(const unsigned char[:, ::1] mask, long long[::1] box) noexcept nogil
cpdef int write_codes(
    const double[::1] orientation, const unsigned char[::1] mask, double per_radian,
    unsigned char[::1] code,
) noexcept nogil
cpdef int write_qualities(
    const unsigned char[::1] quality, const long long[::1] start, double usual, double[::1] scaled,
) noexcept nogil
cpdef int round_weights(float[:, :] root_weight, unsigned char[:, ::1] code) noexcept nogil
