# Words of 64 bits that kernels count side by side: two, where the C compiler has vectors, else one.
cdef extern from *:
    """
    #if defined(__GNUC__)
    typedef unsigned long long bit_lanes __attribute__((vector_size(16)));
    #define LANES 2
    #define lanes_of(first, second) ((bit_lanes){(first), (second)})
    #define lane_of(lanes, k) ((lanes)[k])
    #else
    typedef unsigned long long bit_lanes;
    #define LANES 1
    #define lanes_of(first, second) (first)
    #define lane_of(lanes, k) (lanes)
    #endif
    #if defined(__GNUC__)
    #define lowest_place(bits) __builtin_ctzll(bits)
    #else
    /* The product with a single bit has highest six bits that are different for all 64. */
    static int lowest_place(unsigned long long bits) {
        static const unsigned char place[64] = {
            0, 1, 48, 2, 57, 49, 28, 3, 61, 58, 50, 42, 38, 29, 17, 4,
            62, 55, 59, 36, 53, 51, 43, 22, 45, 39, 33, 30, 24, 18, 12, 5,
            63, 47, 56, 27, 60, 41, 37, 16, 54, 35, 52, 21, 44, 32, 23, 11,
            46, 26, 40, 15, 34, 20, 31, 10, 25, 14, 19, 9, 13, 8, 7, 6
        };
        return place[((bits & (0 - bits)) * 0x03F79D71B4CB0A89ULL) >> 58];
    }
    #endif
    """
    ctypedef unsigned long long bit_lanes
    const int LANES
    bit_lanes lanes_of(unsigned long long first, unsigned long long second) noexcept nogil
    unsigned long long lane_of(bit_lanes lanes, int k) noexcept nogil
    int lowest_place(unsigned long long bits) noexcept nogil  # of a bit that is set; of some bit
