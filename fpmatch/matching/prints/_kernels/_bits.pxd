# The place of a bit, and constants of `_prefilter_kernel` as the C compiler knows them. A word of a
# neighbour: its cell in the first grid; a bit that is set where this cell does not count; three
# bits for the step to the cell of the second grid; a bit that is set where that does not count.
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
    EMPTY = 2048  # a cell beyond the first grid
    SECOND = 4096  # where the second grid begins in the tables
    LAST = 6288  # a cell beyond the second grid: the last of the tables
    BEYOND = 8192  # added, to come to the last
    # A pair that agrees in n words of neighbours and f of orientations weighs 3 n + f - 8.
    TOO_LITTLE = 8
    MOST_WEIGHT = 18
