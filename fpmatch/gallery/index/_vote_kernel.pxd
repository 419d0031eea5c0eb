# Types of the kernel. Arrays may be mapped from a file that cannot be written.


cpdef int count_votes(
    const unsigned int[::1] start, const unsigned int[::1] posting, const int[::1] term,
    const unsigned char[::1] weight, const int[::1] reading,
    const unsigned short[:, ::1] shift, const unsigned short[::1] factor, unsigned int[::1] cursor,
    unsigned int[::1] table, unsigned short[::1] votes,
) noexcept
cdef int _count_votes(
    const unsigned int[::1] start, const unsigned int[::1] posting, const int[::1] term,
    const unsigned char[::1] weight, const int[::1] reading,
    const unsigned short[:, ::1] shift, const unsigned short[::1] factor, unsigned int[::1] cursor,
    unsigned int[::1] table, unsigned short[::1] votes,
) noexcept nogil
cpdef int add_similarity(
    const signed char[:, ::1] embedding, const short[::1] probe, unsigned short[::1] votes,
) noexcept
