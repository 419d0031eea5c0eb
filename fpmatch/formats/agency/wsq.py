"""Decode WSQ (wavelet scalar quantisation), the format of police and border agencies.

FBI, IAFIS-IC-0110 (version 3.1): a tree of wavelet subbands, quantised, run-length and Huffman
coded. The decoder is written here because the one on PyPI wraps C code that crashes the process on
a damaged file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.base.binary_records import ByteReader
from fpmatch.errors import ImageReadError
from fpmatch.image.io.grey import GreyImage, usable_dpi

if TYPE_CHECKING:
    from fpmatch.image.io.grey import ImageLimits
    from fpmatch.image.preprocess.arrays import Floats

START_OF_IMAGE: Final = b"\xff\xa0"
_END, _FRAME, _BLOCK, _FILTERS, _QUANTISERS, _HUFFMAN = range(0xFFA1, 0xFFA7)
_COMMENT: Final = 0xFFA8
_LARGEST_TAP: Final = 2.0  # of a filter: those in use stay below 1
MAX_SEGMENTS: Final = 1000
LONGEST_CODE: Final = 16  # bits of a Huffman code
MAX_TABLES: Final = 8  # of one segment
SUBBANDS: Final = 60  # transmitted, of the 64 of a quantiser table
MAX_MEGAPIXELS: Final = 16.0
MAX_SYMBOLS: Final = 4_000_000  # decoded one by one; an ordinary image has one for ten pixels
_MARKER: Final = re.compile(rb"\xff[^\x00]", re.DOTALL)
_PPI: Final = re.compile(rb"(?:^|[\r\n\0])PPI[ \t]+(\d{2,5})[ \t]*(?:[\r\n\0]|$)")

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


def decode_wsq(data: bytes, limits: ImageLimits) -> GreyImage:
    """Decode a WSQ file of at most 16 megapixels; a comment of NIST's has its resolution."""
    reader = ByteReader(data, _damaged)
    if reader.take(2) != START_OF_IMAGE:
        raise ImageReadError("not a WSQ image")
    decoder = _Decoder(limits)
    segments = 0
    while (marker := reader.number(2)) != _END:
        segments += 1
        if segments > MAX_SEGMENTS:
            raise ImageReadError(f"WSQ image of more than {MAX_SEGMENTS} segments")
        body = ByteReader(reader.take(reader.number(2) - 2), _damaged)
        if marker == _BLOCK:
            end = _MARKER.search(data, reader.at)
            coded = reader.take(reader.left + 1 if end is None else end.start() - reader.at)
            decoder.read_block(body.number(), coded.replace(b"\xff\x00", b"\xff"))
        else:
            decoder.read_segment(marker, body)
    return GreyImage(decoder.pixels(), dpi=usable_dpi(decoder.ppi), format="WSQ")


def _damaged(reason: str) -> ImageReadError:
    return ImageReadError(f"damaged WSQ image ({reason})")


@dataclass(slots=True)
class _Decoder:
    """Tables of the file, and the coefficients decoded so far."""

    limits: ImageLimits
    size: tuple[int, int] | None = None  # width, height
    shift: float = 0.0
    scale: float = 1.0
    filters: Any = None  # of synthesis: low pass, high pass
    bin_center: float = 0.0
    bins: Any = None  # shape (64, 2): width of a bin, of the zero bin
    tables: dict[int, tuple[bytes, bytes]] = field(default_factory=dict)
    ppi: bytes | None = None
    values: list[int] = field(default_factory=list)
    symbols: int = MAX_SYMBOLS  # that may follow
    subband: int = 0  # the next one to be joined, and
    at: int = 0  # its first coefficient

    def read_segment(self, marker: int, body: ByteReader) -> None:
        """Read the segment of a marker, without coefficients."""
        if marker == _FRAME:
            if self.size is not None:
                raise _damaged("two frames")
            body.take(2)  # black and white
            height, width = body.number(2), body.number(2)
            self.limits.check(width, height, most=MAX_MEGAPIXELS)
            self.size = width, height
            self.shift, self.scale = _decimal(body), _decimal(body)
        elif marker == _FILTERS:
            self.filters = _synthesis_filters(body)
        elif marker == _QUANTISERS:
            self.bin_center = _decimal(body)
            self.bins = np.array([[_decimal(body), _decimal(body)] for _ in range(64)])
        elif marker == _HUFFMAN:
            self.tables |= _read_tables(body)
        elif marker == _COMMENT:
            match = _PPI.search(body.take(body.left))
            self.ppi = self.ppi or (match and match[1])
        elif not 0xFFA0 < marker <= 0xFFAF:
            raise _damaged("a marker is missing")

    def read_block(self, table_number: int, coded: bytes) -> None:
        """Append the coefficients of a block, coded by the table of a number."""
        table = self.tables.get(table_number)
        if self.size is None or table is None:
            raise _damaged("coefficients before their tables")
        most = self.size[0] * self.size[1]
        self.symbols = _decode_values(table, coded, self.values, most, self.symbols)
        if not self.symbols:
            raise ImageReadError(f"WSQ image of more than {MAX_SYMBOLS} symbols")

    def pixels(self) -> Any:
        """Return the grey values of the image that has been read."""
        if self.size is None or self.filters is None or self.bins is None:
            raise _damaged("its frame, filters or quantisers are missing")
        joined = self._join(TREE, *self.size)
        if self.at != len(self.values):
            raise _damaged("it has too many coefficients")
        grey = joined * np.float32(self.scale) + np.float32(self.shift) + np.float32(0.5)
        return np.clip(np.nan_to_num(grey), 0, 255).astype(np.uint8)

    def _join(
        self,
        node: tuple[Any, ...],
        width: int,
        height: int,
        *,
        right: bool = False,
        below: bool = False,
    ) -> Floats:
        """Join the subbands below `node`, in a given quarter of its parent, to an image."""
        if not node:
            return self._subband(width, height)
        joined = np.zeros((height, width), np.float32)
        for quarter, part in enumerate(node):
            in_right, in_below = bool(quarter & 1), bool(quarter & 2)
            # Right and lower parts are high frequencies, whose own halves change places.
            high_x, high_y = in_right != right, in_below != below
            inner = (width + (not high_x)) // 2, (height + (not high_y)) // 2
            spread = np.zeros((height, width), np.float32)
            joined_part = self._join(part, *inner, right=in_right, below=in_below)
            spread[int(high_y) :: 2, int(high_x) :: 2] = joined_part
            along_x, along_y = self.filters[high_x], self.filters[high_y]
            edge = cv2.BORDER_REFLECT_101
            joined += cv2.sepFilter2D(spread, cv2.CV_32F, along_x, along_y, borderType=edge)
        return joined

    def _subband(self, width: int, height: int) -> Floats:
        """Return the next subband, in the order of the leaves of the tree, dequantised."""
        step, zero = self.bins[self.subband]
        self.subband += 1
        if self.subband > SUBBANDS or step == 0:
            return np.zeros((height, width), np.float32)
        quantised = np.array(self.values[self.at : self.at + width * height], np.float64)
        if quantised.size != width * height:
            raise _damaged("coefficients are missing")
        self.at += width * height
        value = np.sign(quantised) * (step * (np.abs(quantised) - self.bin_center) + zero / 2)
        return np.asarray(value.reshape(height, width), np.float32)


def _read_tables(body: ByteReader) -> dict[int, tuple[bytes, bytes]]:
    """Read the tables of a segment, by number.

    A table consists of its number, the count of codes of each length from 1 to 16 bits, and their
    symbols in order; codes of one length are consecutive, as in JPEG. Of each word of 16 bits it
    is kept the symbol that it starts with, and the length of its code, 0 where no code fits.
    """
    tables: dict[int, tuple[bytes, bytes]] = {}
    for _ in range(MAX_TABLES):
        if not body.left:
            return tables
        number, counts = body.number(), body.take(LONGEST_CODE)
        lengths = np.repeat(np.arange(1, LONGEST_CODE + 1), list(counts))
        values = np.frombuffer(body.take(len(lengths)), np.uint8)
        words = 1 << (LONGEST_CODE - lengths)  # that begin with each code
        missing = (1 << LONGEST_CODE) - int(words.sum())
        if missing < 0:
            raise _damaged("a Huffman table has too many codes")
        symbols = np.repeat(values, words).tobytes() + bytes(missing)
        tables[number] = (
            symbols,
            np.repeat(lengths, words).astype(np.uint8).tobytes() + bytes(missing),
        )
    raise _damaged("too many Huffman tables")


def _decimal(body: ByteReader, size: int = 2) -> float:
    """Read a number of some bytes with its decimal exponent before it."""
    exponent = body.number()
    return body.number(size) / 10.0**exponent


def _synthesis_filters(body: ByteReader) -> tuple[Floats, Floats]:
    """Return the low and high pass synthesis filters of the given analysis filters."""
    lengths = body.number(), body.number()
    if any(length % 2 == 0 for length in lengths):
        raise ImageReadError("WSQ image with filters of even length, which cannot be read")
    filters = []
    for length in lengths:  # half of a symmetric filter, from its middle on; its signs alternate
        signs = ((-1) ** k * (-1 if body.number() else 1) for k in range((length + 1) // 2))
        half = [sign * _decimal(body, 4) for sign in signs]
        filters.append(np.array([*half[:0:-1], *half], np.float32))
    high, low = filters
    if max(np.abs(high).max(), np.abs(low).max()) > _LARGEST_TAP:
        raise _damaged("a filter amplifies")
    return low, high


def _decode_values(
    table: tuple[bytes, bytes], data: bytes, values: list[int], most: int, symbols_left: int
) -> int:
    """Append the coefficients that `data` codes to `values`, `most` of them altogether.

    Returns the number of symbols that may follow of those that were left.
    """
    symbols, lengths = table
    padded = data + bytes(4)
    at, end = 0, 8 * len(data)
    for left in range(symbols_left, 0, -1):
        if at >= end or len(values) >= most:
            return left
        byte = at >> 3
        word = int.from_bytes(padded[byte : byte + 3], "big") >> (8 - (at & 7)) & 0xFFFF
        length = lengths[word]
        if not length or at + length > end:
            return left  # the ones that fill up the last byte
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
    return 0
