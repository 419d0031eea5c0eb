# Constants of `_descriptor_kernel`, and what fetches memory ahead, as the C compiler knows them.
cdef extern from *:
    """
    #if defined(__GNUC__)
    #define prefetch(address) __builtin_prefetch(address)
    #else
    #define prefetch(address) ((void)(address))
    #endif
    """
    void prefetch(const void *address) noexcept nogil

cdef enum:
    NEIGHBOUR_WORDS = 12
    ORIENTATION_WORDS = 12
    ROOM = 64  # minutiae that are encoded of a print
    PLACES = 256  # what a byte may be
    # Of a word: that it does not count in the first grid, nor in the second; of no neighbour, both.
    NOWHERE = 0x8800
    NOT_FIRST = 1 << 28  # of a neighbour's place
    NOT_SECOND = 1 << 29
    LINE = 16  # words of 32 bits that are fetched at once
    HEAD = 3  # words of 32 bits before the neighbours
    MOST = 9  # of a minutia in all
    AS_THEY_ARE = 15
    QUARTER = 64  # of a turn: where the sectors begin (`APART`)
    DAMAGED = -1
