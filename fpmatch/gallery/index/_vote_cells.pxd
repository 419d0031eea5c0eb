# Constants of `_segment_kernel`, and what fetches memory ahead, as the C compiler knows them.
cdef extern from *:
    """
    #if defined(__GNUC__)
    #define prefetch(address) __builtin_prefetch(address)
    #else
    #define prefetch(address) ((void)(address))
    #endif

    /* The greatest sum of four cells of a print, each of 63 votes at most: of two along x, which are
       sixteen words apart, and two of rotation, of which the last is beside the first. */
    #if defined(__SSE2__)
    #include <emmintrin.h>
    static unsigned int most_votes(const unsigned int *cells) {
        __m128i best = _mm_setzero_si128();
        for (int x = 0; x < 4; x++) {
            __m128i sum[4];
            for (int k = 0; k < 4; k++)
                sum[k] = _mm_add_epi8(
                    _mm_loadu_si128((const __m128i *)(cells + 16 * x + 4 * k)),
                    _mm_loadu_si128((const __m128i *)(cells + 16 * ((x + 1) & 3) + 4 * k)));
            for (int k = 0; k < 4; k++) {
                __m128 own = _mm_castsi128_ps(sum[k]);
                __m128 next = _mm_move_ss(own, _mm_castsi128_ps(sum[(k + 1) & 3]));
                __m128i beside = _mm_shuffle_epi32(_mm_castps_si128(next), 0x39);
                best = _mm_max_epu8(best, _mm_add_epi8(sum[k], beside));
            }
        }
        best = _mm_max_epu8(best, _mm_srli_si128(best, 8));
        best = _mm_max_epu8(best, _mm_srli_si128(best, 4));
        best = _mm_max_epu8(best, _mm_srli_si128(best, 2));
        best = _mm_max_epu8(best, _mm_srli_si128(best, 1));
        return _mm_cvtsi128_si32(best) & 255;
    }
    #else
    static unsigned int most_votes(const unsigned int *cells) {
        unsigned int sum[64], four[64];
        const unsigned char *each = (const unsigned char *)four;
        unsigned char best = 0;
        for (int k = 0; k < 64; k++)
            sum[k] = cells[k] + cells[(k + 16) & 63];
        for (int k = 0; k < 64; k++)
            four[k] = sum[k] + sum[(k & 48) | ((k + 1) & 15)];
        for (int k = 0; k < 256; k++)
            best = each[k] > best ? each[k] : best;
        return best;
    }
    #endif
    """
    unsigned int most_votes(const unsigned int *cells) noexcept nogil
    void prefetch(const void *address) noexcept nogil

cdef enum:
    AHEAD = 24  # lists, of which the first postings are fetched; where one begins, twice as many
    TURN = 63  # the steps of a rotation are numbered by its bits
    CELLS = 256  # of a print
    WORDS = 64  # of four cells along y
    MOST = 63  # votes that are counted in a cell: four make less than 256
    LENGTH = 128  # of an embedding
    PRODUCT_BITS = 5  # of a product, that do not count
    TURNED = 300  # what is subtracted from the product of a turned print: few probes are turned
