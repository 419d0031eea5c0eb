# The bits of words, which `fpmatch.matching.constants` describes, for the C compiler.
cdef extern from *:
    """
    #if defined(__GNUC__)
    #define lowest_place(bits) __builtin_ctzll(bits)
    #else
    static int lowest_place(unsigned long long bits) {
        int place = 0;
        while (!(bits >> place & 1)) place++;
        return place;
    }
    #endif
    """
    int lowest_place(unsigned long long bits) noexcept nogil  # of a bit that is set

cdef enum:
    WORDS = 12  # of a minutia: of neighbours, and as many of orientations
    ROOM = 64  # minutiae in the tables: bits of a word
    CELL = 0x07FF
    FIRST = 0x0FFF  # cell, and the bit that states whether it counts
    LAST = 6288  # a cell beyond the second grid: the last of the tables
    SECOND = 4096  # where the second grid begins in the tables
    BEYOND = 8192  # added, to come to the last
    # A pair that agrees in n words of neighbours and f of orientations weighs 3 n + f - 8.
    TOO_LITTLE = 8
    MOST_WEIGHT = 18

# The place in the tables of the cell of the second grid that a word contains. Half a cell on in
# direction, the last sector runs into the first one of the next column; so it is with every print.
cdef inline int second(int word) noexcept nogil:
    return SECOND + (word & CELL) + (word >> 12 & 1) + (word >> 10 & 8) + (word >> 7 & 128)
