# Types of the kernel. Arrays may be mapped from a file that cannot be written.

# of `matching.constants`
cdef int NEIGHBOUR_WORDS, ORIENTATION_WORDS, CELLS_ALONG, SECTORS, NOT_FIRST, NOT_SECOND, NOWHERE
cdef int STEPS, ORIENTATION_BINS, ORIENTATIONS
cdef double APART


cpdef int encode_neighbours(
    const int[::1] count, const float[:, :, ::1] frame, const float[:, ::1] angle,
    const unsigned char[::1] coded, double per_px, unsigned short[:, ::1] word,
) noexcept
cpdef int encode_orientations(
    const double[:, ::1] points, const unsigned char[::1] direction_bin,
    const unsigned char[:, ::1] cell, int first_row, int first_column, double step,
    const double[:, ::1] places, unsigned char[:, ::1] word,
) noexcept
