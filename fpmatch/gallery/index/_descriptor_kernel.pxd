# Types of the kernel. Arrays may be mapped from a file that cannot be written.
from fpmatch.matching.prints._kernels._prefilter_kernel cimport Prefilter


cpdef int score_prints(
    Prefilter tables, const long long[::1] start, const short[:, ::1] xy,
    const unsigned char[::1] direction_bin, const unsigned short[:, ::1] neighbour_bits,
    const unsigned char[:, ::1] orientation_bins, const unsigned char[::1] has_flow,
    const long long[::1] which, const int[::1] places, float[:, ::1] room,
    unsigned short[:, ::1] words, unsigned char[:, ::1] bins, int[::1] score,
)
