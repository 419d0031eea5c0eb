# Constants of `_prefilter_kernel`, as the C compiler knows them. A word of a neighbour: its cell in
# the first grid; a bit that is set where this cell does not count; three bits for the step from
# there to the cell of the second grid; a bit that is set where that cell does not count.
cdef enum:
    WORDS = 12  # of a minutia: of neighbours, and as many of orientations
    ROOM = 64  # minutiae in the tables: bits of a word
    CELL = 0x07FF
    FIRST = 0x0FFF  # cell, and the bit that states whether it counts
    EMPTY = 2048  # a cell beyond the first grid
    SECOND = 4096  # where the second grid begins in the tables
    LAST = 6288  # a cell beyond the second grid: the last of the tables
    BEYOND = 8192  # added, to come to the last
    BINS_1 = 32  # of the next word of orientation in the tables, and of those after it
    BINS_2 = 64
    BINS_3 = 96
    # A pair that agrees in n words of neighbours and f of orientations weighs 3 n + f - 8.
    TOO_LITTLE = 8
    MOST_WEIGHT = 18
