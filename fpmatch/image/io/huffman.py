"""Huffman codes of WSQ files, as tables indexed by 16 bits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from fpmatch.errors import ImageReadError

if TYPE_CHECKING:
    from fpmatch.image.io.byte_reader import ByteReader

LONGEST_CODE: Final = 16
MAX_TABLES: Final = 8  # of one segment


@dataclass(frozen=True, slots=True)
class HuffmanTable:
    """Hold the symbol whose code each word of 16 bits starts with, and the bits of that code.

    The length is 0 where no code fits.
    """

    symbols: bytes
    lengths: bytes


def read_huffman_tables(body: ByteReader) -> dict[int, HuffmanTable]:
    """Read the tables of a segment, by number; raise ImageReadError if they are inconsistent.

    A table consists of its number, the count of codes of each length from 1 to 16 bits, and their
    symbols in order; codes of one length are consecutive, as in JPEG.
    """
    tables: dict[int, HuffmanTable] = {}
    for _ in range(MAX_TABLES):
        if not body.left:
            return tables
        number = body.u8()
        counts = body.take(LONGEST_CODE)
        tables[number] = _table(counts, body.take(sum(counts)))
    raise ImageReadError("damaged WSQ image (too many Huffman tables)")


def _table(counts: bytes, values: bytes) -> HuffmanTable:
    symbols, lengths = bytearray(), bytearray()
    first = 0
    for length, count in enumerate(counts, start=1):
        span = 1 << (LONGEST_CODE - length)
        for value in values[first : first + count]:
            symbols += bytes([value]) * span
            lengths += bytes([length]) * span
            if len(symbols) > 1 << LONGEST_CODE:
                raise ImageReadError("damaged WSQ image (a Huffman table has too many codes)")
        first += count
    missing = (1 << LONGEST_CODE) - len(symbols)
    return HuffmanTable(bytes(symbols) + bytes(missing), bytes(lengths) + bytes(missing))
