# Constants of `_vote_kernel`, and what fetches memory ahead, as the C compiler knows them.
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
    AHEAD = 12  # lists, of which the first posting is fetched
    TURN = 63  # the steps of a rotation are numbered by its bits
    CELLS = 256  # of a print
    WORDS = 64  # of four cells along y
    TURNS = 16  # of them, of the rotations of one shift along x
    PRINTS = 2048  # whose cells lie in the table at once
    MOST = 63  # votes that are counted in a cell: four make less than 256
