"""Damage of files: a few places changed, cut out, doubled or exchanged, with right checksums."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import random
    from collections.abc import Callable, Sequence

MOST_BYTES = 4 * 2**20  # of an input
REPAIRED_SHARE = 0.75  # of the inputs of formats whose lengths and checksums can be corrected
EXTREMES = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
WORDS = (
    *(b"0", b"-1", b"99999", b"nan", b"inf", b"1e308", b"5e-324", b"3e38", b"", b"4294967296"),
    *(b"\xff\xfe", b"[" * 50, b"\x1b[31m", b"\n", b"\r", b"\0", b"\xed\xa0\x80", b"%s", b"9" * 400),
)
PNG = b"\x89PNG\r\n\x1a\n"


def damaged(
    rng: random.Random,
    corpus: Sequence[bytes],
    words: Sequence[bytes] = (),
    repair: Callable[[bytearray], bytes] | None = None,
) -> bytes:
    """Return a file of the corpus with a few places changed."""
    data = bytearray(rng.choice(corpus))
    for _ in range(rng.choice((1, 1, 2, 3, 5, 8))):
        at = rng.randrange(len(data) + 1)
        if rng.random() < 0.5:
            at = min(at, rng.randrange(64))  # headers decide most
        length = rng.choice((1, 1, 2, 4, 8, rng.randrange(1, 64)))
        way = rng.randrange(8)
        if way == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif way == 1:
            data[at : at + length] = rng.randbytes(length)
        elif way == 2:
            size = rng.choice((1, 2, 4))
            number = rng.choice(EXTREMES) & ((1 << 8 * size) - 1)
            data[at : at + size] = number.to_bytes(size, rng.choice(("big", "little")))
        elif way == 3:
            del data[at : at + length]
        elif way == 4:
            data[at:at] = data[at : at + length] * rng.choice((1, 2, 20))
        elif way == 5:
            data[at : at + rng.choice((0, length))] = rng.choice((*WORDS, *words))
        elif way == 6:
            other = rng.choice(corpus)
            data[at:] = other[rng.randrange(len(other) + 1) :]
        elif rng.random() < 0.3:
            del data[at:]
    del data[MOST_BYTES:]
    repaired = repair is not None and rng.random() < REPAIRED_SHARE
    return repair(data) if repair and repaired else bytes(data)


def with_right_sums(png: bytearray) -> bytes:
    """Return a PNG with right checksums, which otherwise stop nearly all damage."""
    at = len(PNG)
    while at + 12 <= len(png):
        end = at + 8 + struct.unpack_from(">L", png, at)[0]
        if end + 4 > len(png):
            break
        struct.pack_into(">L", png, end, zlib.crc32(png[at + 4 : end]))
        at = end + 4
    return bytes(png)


def with_right_sum(body: bytearray) -> bytes:
    """Return a gallery's packed template with the right checksum at its end."""
    del body[-4:]
    return bytes(body) + zlib.crc32(body).to_bytes(4, "little")


def with_right_length(record: bytearray) -> bytes:
    """Return a record of minutiae with the length that its version states."""
    version, length = bytes(record[4:8]), len(record)
    if version == b" 20\0" and record[8:10] != b"\0\0":  # ANSI 378: two bytes, if they suffice
        record[8:10] = min(length, 0xFFFF).to_bytes(2, "big")
    else:
        record[8:12] = length.to_bytes(4, "big")
    return bytes(record)
