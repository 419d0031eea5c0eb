"""Mutators of binary records: templates and pictures, with right lengths and sums."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

from research.fuzzing.mutators.octets import EXTREMES
from research.fuzzing.mutators.text import CELLS

if TYPE_CHECKING:
    import random

PNG = b"\x89PNG\r\n\x1a\n"
_SEPARATORS = (b"\x1c", b"\x1d", b"\x1e", b"\x1f")  # of files, groups, records and units of AN2
_TIFF_TYPES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 7: 1, 9: 4, 11: 4, 12: 8, 16: 8}  # bytes of each


def fmr_field(rng: random.Random, data: bytes) -> bytes:
    """Change fields of a finger minutiae or image record, and correct its length."""
    record = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4))):
        at, way = rng.randrange(12, len(record)), rng.randrange(5)
        if way <= 1:
            size = rng.choice((1, 2, 2, 4))
            number = rng.choice(EXTREMES) & ((1 << 8 * size) - 1)
            record[at : at + size] = number.to_bytes(size, "big")
        elif way == 2:
            record[at] ^= 1 << rng.randrange(8)
        elif way == 3:
            del record[at : at + rng.choice((1, 2, 5, 6, 12))]
        else:
            record[at:at] = record[at : at + rng.choice((1, 2, 5, 6, 60))]
    return _with_length(record)


def an2_field(rng: random.Random, data: bytes) -> bytes:
    """Change one item or field of the tagged records of an AN2 file, with right lengths."""
    records = data.split(b"\x1c")
    which = rng.randrange(len(records))
    fields = records[which].split(b"\x1d")
    at, way = rng.randrange(len(fields)), rng.randrange(6)
    tag, colon, value = fields[at].partition(b":")
    if way <= 2:
        separator = rng.choice(_SEPARATORS[2:])
        items = value.split(separator)
        word = rng.choice(CELLS).encode("utf-8", "surrogatepass")
        items[rng.randrange(len(items))] = word
        fields[at] = tag + colon + separator.join(items)
    elif way == 3:
        fields.insert(at, fields[rng.randrange(len(fields))])
    elif way == 4 and at:
        del fields[at]
    else:
        kind, dot, _ = tag.partition(b".")
        number = str(rng.choice((1, 2, 3, 6, 7, 8, 9, 10, 11, 12, 14, 23, 137, 300, 331, 999)))
        fields[at] = kind + dot + number.zfill(3).encode() + colon + value
    records[which] = _an2_record(fields)
    return b"\x1c".join(records)


def tiff_tag(rng: random.Random, data: bytes) -> bytes:
    """Change the tag, type, number or value of an entry of the first directory of a TIFF file."""
    order = {b"II": "<", b"MM": ">"}[data[:2]]
    file = bytearray(data)
    (start,) = struct.unpack_from(f"{order}L", file, 4)
    (count,) = struct.unpack_from(f"{order}H", file, start)
    at = start + 2 + 12 * rng.randrange(count)
    tag, kind, number, value = struct.unpack_from(f"{order}2H2L", file, at)
    way = rng.randrange(6)
    if way == 0:
        tag = rng.choice((254, 256, 257, 258, 259, 262, 273, 274, 277, 278, 279, 282, 296, 317))
    elif way == 1:
        kind = rng.choice((*_TIFF_TYPES, 0, 99))
    elif way == 2:
        number = rng.choice((*EXTREMES, number + 1, 2))
    elif way == 3 and number * _TIFF_TYPES.get(kind, 1) > 4:  # then the value is elsewhere
        place = min(value, len(file) - 1)
        file[place : place + 8] = rng.choice((b"\n\x1b[31m\0\n", bytes(8), b"\xff" * 8))
    else:
        value = rng.choice((*EXTREMES, 1, 2, 3, 5, 7, 32773, rng.randrange(len(file))))
        if order == ">" and kind == 3:
            value <<= 16
    struct.pack_into(f"{order}2H2L", file, at, tag, kind, number & 0xFFFFFFFF, value & 0xFFFFFFFF)
    return bytes(file)


def png_chunk(rng: random.Random, data: bytes) -> bytes:
    """Change, remove, double or move a chunk of a PNG file; all checksums are right."""
    chunks, at = [], len(PNG)
    while at + 12 <= len(data):
        end = at + 12 + struct.unpack_from(">L", data, at)[0]
        chunks.append((data[at + 4 : at + 8], bytearray(data[at + 8 : end - 4])))
        at = end
    which, way = rng.randrange(len(chunks)), rng.randrange(6)
    name, body = chunks[which]
    if way == 0:
        del chunks[which]
    elif way == 1:
        chunks.insert(rng.randrange(len(chunks)), chunks[which])
    elif way == 2:
        chunks[which] = (rng.choice((b"IDAT", b"PLTE", b"tRNS", b"pHYs", b"tEXt", b"iCCP")), body)
    elif way == 3 and name == b"IDAT":
        pixels = bytearray(zlib.decompress(body))
        pixels[rng.randrange(len(pixels))] = rng.randrange(256)
        chunks[which] = (name, bytearray(zlib.compress(pixels * rng.choice((1, 1, 2)))))
    elif body:
        number = rng.choice(EXTREMES).to_bytes(4, "big")
        place = rng.randrange(len(body))
        body[place : place + 4] = number[-len(body[place : place + 4]) :]
    return PNG + b"".join(chunk(*one) for one in chunks)


def with_right_sums(png: bytes | bytearray) -> bytes:
    """Return a PNG with right checksums, which otherwise stop nearly all damage."""
    file, at = bytearray(png), len(PNG)
    while at + 12 <= len(file):
        end = at + 8 + struct.unpack_from(">L", file, at)[0]
        if end + 4 > len(file):
            break
        struct.pack_into(">L", file, end, zlib.crc32(file[at + 4 : end]))
        at = end + 4
    return bytes(file)


def png_sums(rng: random.Random, data: bytes) -> bytes:
    """Change some bytes of a PNG, and correct the checksums."""
    file = bytearray(data)
    for _ in range(rng.choice((1, 2, 4))):
        file[rng.randrange(len(PNG), len(file))] ^= 1 << rng.randrange(8)
    return with_right_sums(file)


def stored_template(rng: random.Random, data: bytes) -> bytes:
    """Change some bytes of a gallery's packed template, and correct its checksum."""
    body = bytearray(data[:-4])
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(4, rng.choice((26, len(body))))
        size = rng.choice((1, 2, 4))
        number = rng.choice((*EXTREMES, rng.randrange(1 << 32))) & ((1 << 8 * size) - 1)
        body[at : at + size] = number.to_bytes(size, "little")
    if rng.random() < 0.2:
        del body[rng.randrange(len(body)) :]
    return bytes(body) + zlib.crc32(body).to_bytes(4, "little")


def _with_length(record: bytearray) -> bytes:
    """Return a record with the length that its version states at its place."""
    version, length = bytes(record[4:8]), len(record)
    if record[:4] == b"FIR\0" and version == b"010\0":
        record[8:14] = length.to_bytes(6, "big")
    elif version == b" 20\0" and record[8:10] != b"\0\0":  # ANSI 378: two bytes, if they suffice
        record[8:10] = min(length, 0xFFFF).to_bytes(2, "big")
    else:
        record[8:12] = length.to_bytes(4, "big")
    return bytes(record)


def _an2_record(fields: list[bytes]) -> bytes:
    """Return the fields of a record as one, with the record's own length as the first."""
    tag, colon, _ = fields[0].partition(b":")
    if not tag.endswith(b".001"):
        return b"\x1d".join(fields)
    rest = b"".join(b"\x1d" + field for field in fields[1:])
    length = len(tag) + len(colon) + len(rest) + 1
    length += len(str(length + len(str(length))))
    return tag + colon + str(length).encode() + rest


def chunk(name: bytes, body: bytes | bytearray) -> bytes:
    """Return a chunk of a PNG file."""
    return struct.pack(">L", len(body)) + name + body + struct.pack(">L", zlib.crc32(name + body))
