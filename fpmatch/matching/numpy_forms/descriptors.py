"""Numpy form of `_prefilter_kernel`: which minutiae agree in enough words of bit descriptors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Numbers = NDArray[np.int64]

WORDS: Final = 12  # of neighbours, and as many of orientations
SIDE: Final = 16
SECTORS: Final = 8
CELL: Final = 0x07FF
NOT_FIRST: Final = 0x0800
NOT_SECOND: Final = 0x8000
STEPS: Final = 12
SECOND: Final = 4096
EMPTY: Final = 2048  # a cell beyond the first grid
OF_NEIGHBOUR: Final = 3
TOO_LITTLE: Final = 8
MOST_WEIGHT: Final = 18


def second(word: Numbers) -> Numbers:
    """Return the places in the tables of the cells of the second grid that words contain."""
    place = SECOND + (word & CELL)
    place += (word >> STEPS & 1) + SECTORS * (word >> (STEPS + 1) & 1)
    return place + SECTORS * SIDE * (word >> (STEPS + 2) & 1)


def count_bits(words: NDArray[np.uint64]) -> tuple[NDArray[np.uint64], ...]:
    """Count, for each place of a bit, in how many of the rows it is set: ones, twos and so on."""
    ones, twos, fours, eights = np.zeros((4, words.shape[1]), np.uint64)
    for word in words:
        carry = ones & word
        ones ^= word
        rest = twos & carry
        twos ^= carry
        carry = fours & rest
        fours ^= rest
        eights ^= carry
    return ones, twos, fours, eights


def pair(
    tables: Any,
    first: int,
    last: int,
    neighbour_bits: Any,
    orientation_bins: Any,
    flowing: bool,
    _other_first: bool,
) -> int:
    """Gather the pairs of minutiae that agree in enough words; return their number.

    Bit k of a word stands for minutia k in the tables. All pairs are gathered, although only the
    heaviest are kept.
    """
    table = np.asarray(tables.neighbour_table)
    words = np.asarray(neighbour_bits)[first:last].T.astype(np.int64)
    in_first = np.where(words & NOT_FIRST, EMPTY, words & CELL)
    in_second = np.where(words & NOT_SECOND, EMPTY, second(words))
    n1, n2, n4, n8 = count_bits(table[in_first])
    s1, s2, s4, s8 = count_bits(table[in_second])
    # the sum of both, from the ones up
    n1, carry = n1 ^ s1, n1 & s1
    n2, carry = n2 ^ s2 ^ carry, (n2 & s2) | ((n2 ^ s2) & carry)
    n4, carry = n4 ^ s4 ^ carry, (n4 & s4) | ((n4 ^ s4) & carry)
    n8, n16 = n8 ^ s8 ^ carry, (n8 & s8) | ((n8 ^ s8) & carry)
    if flowing:
        bins = np.asarray(orientation_bins)[first:last].T
        f1, f2, f4, f8 = count_bits(
            np.asarray(tables.orientation_table)[np.arange(WORDS)[:, None], bins]
        )
    else:  # six are taken to agree
        f1 = f8 = np.zeros_like(n1)
        f2 = f4 = ~f1
    # what weighs anything: three neighbours; two, and three orientations; one, and six
    enough = n4 | n8 | n16 | (n2 & (n1 | f4 | f8 | (f1 & f2))) | (n1 & (f8 | (f4 & f2)))
    some = enough.nonzero()[0]
    bits = np.arange(64, dtype=np.uint64)
    at, own = ((enough[some, None] >> bits) & np.uint64(1)).nonzero()
    other, place = some[at], own.astype(np.uint64)
    neighbours, orientations = (
        sum(((word[other] >> place) & np.uint64(1)).astype(np.int64) << k for k, word in of)
        for of in (enumerate((n1, n2, n4, n8, n16)), enumerate((f1, f2, f4, f8)))
    )
    weight = OF_NEIGHBOUR * neighbours - TOO_LITTLE + orientations
    tables.pairs.count = len(own)
    pairs = np.asarray(tables.pairs.pair)
    pairs[0, : len(own)], pairs[1, : len(own)] = own, other
    pairs[2, : len(own)] = weight = np.minimum(weight, MOST_WEIGHT)
    most = tables.pairs.most
    tables.pairs.least = least = np.sort(weight)[-most] if len(own) >= most else 0
    tables.pairs.equal = most - np.count_nonzero(weight > least)
    return len(own)
