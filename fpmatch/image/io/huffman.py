"""Huffman codes as WSQ files carry them: tables for 16 bits at a time."""

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
    """Hold, for every word of 16 bits, the symbol whose code the word starts with.

    Parameters
    ----------
    symbols : bytes
        The symbol of each word, 65,536 of them.
    lengths : bytes
        Bits of its code; 0 where no code fits.
    """

    symbols: bytes
    lengths: bytes


def read_huffman_tables(body: ByteReader) -> dict[int, HuffmanTable]:
    """Read the tables of a segment, by their numbers.

    Each is a number, how many codes there are of 1 to 16 bits, and their symbols in order; codes
    of one length follow each other, as in JPEG.

    Raises
    ------
    ImageReadError
        If the codes do not fit into their lengths, or symbols are missing.
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
