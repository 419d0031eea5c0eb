"""Decode WSQ (wavelet scalar quantisation), the format of police and border agencies.

FBI, IAFIS-IC-0110 (version 3.1): a tree of wavelet subbands, quantised, run-length and Huffman
coded. The decoder is written here because the one on PyPI wraps C code that crashes the process on
a damaged file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

import cv2
import numpy as np

from fpmatch.base.binary_records import ByteReader
from fpmatch.errors import ImageReadError
from fpmatch.image.io.grey import GreyImage
from fpmatch.image.io.resolution import usable_dpi

if TYPE_CHECKING:
    from fpmatch.image.io.grey import ImageLimits
    from fpmatch.image.preprocess.arrays import Doubles, Floats

    Filters = tuple[Floats, Floats]

START_OF_IMAGE: Final = b"\xff\xa0"
_END, _FRAME, _BLOCK, _FILTERS, _QUANTISERS, _HUFFMAN = range(0xFFA1, 0xFFA7)
_COMMENT: Final = 0xFFA8
_LARGEST_TAP: Final = 2.0  # of a filter: those in use stay below 1
MAX_SEGMENTS: Final = 1000
LONGEST_CODE: Final = 16  # bits of a Huffman code
MAX_TABLES: Final = 8  # of one segment
SUBBANDS: Final = 60  # transmitted, of the 64 of a quantiser table
MAX_MEGAPIXELS: Final = 16.0  # symbols are decoded one by one: about a second a megapixel
_MARKER: Final = re.compile(rb"\xff[^\x00]", re.DOTALL)
_PPI: Final = re.compile(rb"(?:^|\n)PPI (\d{2,5})(?:\n|$)")

# How the image is split: each node into top left, top right, bottom left and bottom right.
_LEAF: Final = ()
_FOUR: Final = (_LEAF,) * 4
_SIXTEEN: Final = (_FOUR,) * 4
_LOWEST: Final = ((_FOUR, _LEAF, _LEAF, _LEAF), _FOUR, _FOUR, _FOUR)
TREE: Final = ((_LOWEST, _SIXTEEN, _SIXTEEN, _LEAF), _FOUR, _FOUR, _LEAF)

# Huffman symbols: up to 100 the length of a run of zeros, from 107 on a value; between them
# escapes, whose value or run length follows: (its bits, the sign of the value or 0 for a run).
_LONGEST_RUN, _ZERO_SYMBOL = 100, 180
_ESCAPES: Final = {
    101: (8, 1), 102: (8, -1), 103: (16, 1), 104: (16, -1), 105: (8, 0), 106: (16, 0)
}  # fmt: skip


class _HuffmanTable(NamedTuple):
    """The symbol, and the length of its code, that each word of 16 bits starts with."""

    symbols: bytes
    lengths: bytes  # in bits; 0 where no code fits


@dataclass(slots=True)
class _Header:
    """Tables of the file, and the coefficients decoded so far."""

    size: tuple[int, int] | None = None  # width, height
    shift: float = 0.0
    scale: float = 1.0
    filters: Filters | None = None  # of synthesis: low pass, high pass
    bin_center: float = 0.0
    bins: Doubles | None = None  # shape (64, 2): width of a bin, of the zero bin
    tables: dict[int, _HuffmanTable] = field(default_factory=dict)
    comments: list[bytes] = field(default_factory=list)
    values: list[int] = field(default_factory=list)


def decode_wsq(data: bytes, limits: ImageLimits) -> GreyImage:
    """Decode a WSQ file of at most 16 megapixels; a comment of NIST's has its resolution."""
    header = _Header()
    reader = ByteReader(data, _damaged)
    if reader.take(2) != START_OF_IMAGE:
        raise ImageReadError("not a WSQ image")
    segments = 0
    while (marker := reader.number(2)) != _END:
        segments += 1
        if segments > MAX_SEGMENTS:
            raise ImageReadError(f"WSQ image of more than {MAX_SEGMENTS} segments")
        body = ByteReader(reader.take(reader.number(2) - 2), _damaged)
        if marker == _BLOCK:
            _read_block(body, reader, header)
        else:
            _read_segment(marker, body, header, limits)
    if header.size is None or header.filters is None or header.bins is None:
        raise _damaged("its frame, filters or quantisers are missing")
    subbands = _Subbands(np.array(header.values, np.float64), header.bin_center, header.bins)
    joined = _join_node(TREE, header.size, subbands, header.filters)
    subbands.check_end()
    grey = joined * np.float32(header.scale) + np.float32(header.shift) + np.float32(0.5)
    ppi = next((m[1] for c in header.comments if (m := _PPI.search(c))), None)
    pixels = np.clip(np.nan_to_num(grey), 0, 255).astype(np.uint8)
    return GreyImage(pixels, dpi=usable_dpi(ppi), format="WSQ")


def _damaged(reason: str) -> ImageReadError:
    return ImageReadError(f"damaged WSQ image ({reason})")


def _read_segment(marker: int, body: ByteReader, header: _Header, limits: ImageLimits) -> None:
    """Read one marker segment into `header`."""
    if marker == _FRAME:
        if header.size is not None:
            raise _damaged("two frames")
        body.take(2)  # black and white
        height, width = body.number(2), body.number(2)
        limits.check(width, height, max_megapixels=MAX_MEGAPIXELS)
        header.size = width, height
        header.shift, header.scale = _decimal(body), _decimal(body)
    elif marker == _FILTERS:
        header.filters = _synthesis_filters(body)
    elif marker == _QUANTISERS:
        header.bin_center = _decimal(body)
        header.bins = np.array([[_decimal(body), _decimal(body)] for _ in range(64)])
    elif marker == _HUFFMAN:
        header.tables |= _read_tables(body)
    elif marker == _COMMENT:
        header.comments.append(body.take(body.left))
    elif not 0xFFA0 < marker <= 0xFFAF:
        raise _damaged("a marker is missing")


def _read_tables(body: ByteReader) -> dict[int, _HuffmanTable]:
    """Read the tables of a segment, by number.

    A table consists of its number, the count of codes of each length from 1 to 16 bits, and their
    symbols in order; codes of one length are consecutive, as in JPEG.
    """
    tables: dict[int, _HuffmanTable] = {}
    for _ in range(MAX_TABLES):
        if not body.left:
            return tables
        number = body.number()
        counts = body.take(LONGEST_CODE)
        tables[number] = _huffman_table(counts, body.take(sum(counts)))
    raise _damaged("too many Huffman tables")


def _huffman_table(counts: bytes, values: bytes) -> _HuffmanTable:
    symbols, lengths = bytearray(), bytearray()
    first = 0
    for length, count in enumerate(counts, start=1):
        span = 1 << (LONGEST_CODE - length)
        for value in values[first : first + count]:
            symbols += bytes([value]) * span
            lengths += bytes([length]) * span
            if len(symbols) > 1 << LONGEST_CODE:
                raise _damaged("a Huffman table has too many codes")
        first += count
    missing = (1 << LONGEST_CODE) - len(symbols)
    return _HuffmanTable(bytes(symbols) + bytes(missing), bytes(lengths) + bytes(missing))


def _decimal(body: ByteReader) -> float:
    """Read a number of 16 bits with its decimal exponent before it."""
    exponent = body.number()
    return body.number(2) / 10.0**exponent


def _synthesis_filters(body: ByteReader) -> Filters:
    """Return the low and high pass filters of the synthesis from those of the analysis."""
    lengths = body.number(), body.number()
    if any(length % 2 == 0 for length in lengths):
        raise ImageReadError("WSQ image with filters of even length, which cannot be read")
    high, low = (_alternating(body, length) for length in lengths)
    if max(np.abs(high).max(), np.abs(low).max()) > _LARGEST_TAP:
        raise _damaged("a filter amplifies")
    return low, high


def _alternating(body: ByteReader, length: int) -> Floats:
    """Read half a symmetric filter, from its middle on; return all of it, signs alternating."""
    half = []
    for k in range((length + 1) // 2):
        sign = -1 if body.number() else 1
        exponent = body.number()
        half.append((-1) ** k * sign * body.number(4) / 10.0**exponent)
    return np.array([*half[:0:-1], *half], np.float32)


def _read_block(body: ByteReader, reader: ByteReader, header: _Header) -> None:
    """Decode the block of coefficients, up to the next marker, that a segment announces."""
    table = header.tables.get(body.number())
    if header.size is None or table is None:
        raise _damaged("coefficients before their tables")
    end = _MARKER.search(reader.data, reader.at)
    coded = reader.take(reader.left + 1 if end is None else end.start() - reader.at)
    width, height = header.size
    _decode_values(table, coded.replace(b"\xff\x00", b"\xff"), header.values, width * height)


def _decode_values(table: _HuffmanTable, data: bytes, values: list[int], most: int) -> None:
    """Append the coefficients that `data` codes to `values`, `most` of them altogether."""
    symbols, lengths = table.symbols, table.lengths
    padded = data + bytes(4)
    at, end = 0, 8 * len(data)
    while at < end and len(values) < most:
        byte = at >> 3
        word = int.from_bytes(padded[byte : byte + 3], "big") >> (8 - (at & 7)) & 0xFFFF
        length = lengths[word]
        if not length or at + length > end:
            break  # the ones that fill up the last byte
        at += length
        symbol = symbols[word]
        if symbol > 106:
            values.append(symbol - _ZERO_SYMBOL)
        elif 0 < symbol <= _LONGEST_RUN:
            values.extend([0] * symbol)
        elif symbol in _ESCAPES:
            bits, sign = _ESCAPES[symbol]
            byte = at >> 3
            word = int.from_bytes(padded[byte : byte + 3], "big") >> (8 - (at & 7)) & 0xFFFF
            number = word >> (16 - bits)
            at += bits
            if not sign and not number:
                raise _damaged("a run of no coefficients")
            values.extend([sign * number] if sign else [0] * number)
        else:
            raise _damaged("an unknown symbol")


@dataclass(slots=True)
class _Subbands:
    """The coefficients of the subbands, in the order of the leaves of the tree."""

    values: Doubles
    bin_center: float
    bins: Doubles
    number: int = 0  # of the next subband
    at: int = 0  # its first coefficient

    def take(self, width: int, height: int) -> Floats:
        """Return the next subband, dequantised."""
        step, zero = self.bins[self.number]
        self.number += 1
        if self.number > SUBBANDS or step == 0:
            return np.zeros((height, width), np.float32)
        quantised = self.values[self.at : self.at + width * height]
        if quantised.size != width * height:
            raise _damaged("coefficients are missing")
        self.at += width * height
        value = np.sign(quantised) * (step * (np.abs(quantised) - self.bin_center) + zero / 2)
        return np.asarray(value.reshape(height, width), np.float32)

    def check_end(self) -> None:
        """Raise ImageReadError if coefficients are left."""
        if self.at != len(self.values):
            raise _damaged("it has too many coefficients")


def _join_node(
    node: tuple[object, ...],
    size: tuple[int, int],
    subbands: _Subbands,
    filters: Filters,
    *,
    right: bool = False,
    below: bool = False,
) -> Floats:
    """Join the subbands below `node`, in a given quarter of its parent, to an image."""
    width, height = size
    if not node:
        return subbands.take(width, height)
    joined = np.zeros((height, width), np.float32)
    for quarter, part in enumerate(node):
        in_right, in_below = bool(quarter & 1), bool(quarter & 2)
        # Right and lower parts are high frequencies, whose own halves change places.
        high_x, high_y = in_right != right, in_below != below
        inner = (width + (not high_x)) // 2, (height + (not high_y)) // 2
        quarter_image = _join_node(part, inner, subbands, filters, right=in_right, below=in_below)  # type: ignore[arg-type]
        spread = np.zeros((height, width), np.float32)
        spread[int(high_y) :: 2, int(high_x) :: 2] = quarter_image
        joined += cv2.sepFilter2D(
            spread, cv2.CV_32F, filters[high_x], filters[high_y], borderType=cv2.BORDER_REFLECT_101
        )
    return joined
