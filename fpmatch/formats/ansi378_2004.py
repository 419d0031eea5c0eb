"""Templates as finger minutiae records of ANSI/INCITS 378-2004.

As ISO/IEC 19794-2:2005, but for a longer header and angles in 180 steps of two degrees.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from fpmatch.formats import fmr
from fpmatch.formats.codec import Codec
from fpmatch.formats.iso19794_2_2005 import (
    frame_bytes,
    is_ansi_2004,
    read_view_2005,
    write_view_2005,
)
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

if TYPE_CHECKING:
    from fpmatch.formats.byte_reader import ByteReader

VERSIONS: Final = (b" 20\x00", b"020\x00")  # the second in early files only
HEADER_BYTES: Final = 26
LONG_LENGTH: Final = 2**16  # from which on the length takes six bytes
LAYOUT: Final = fmr.Layout("ansi2004", fmr.ANSI_STEPS, zero_is_unknown=True)


def decode(data: bytes, how: ReadingOptions) -> TemplateRecord:
    """Return the prints that a record holds, or raise TemplateError."""
    return fmr.decode_ansi(lambda layout: _decode(data, how, layout), LAYOUT)


def _decode(data: bytes, how: ReadingOptions, layout: fmr.Layout) -> TemplateRecord:
    reader, notes = fmr.begin(data, *VERSIONS), list[str]()
    declared = reader.number(2) or reader.number(4)
    fields = product_fields(reader)
    frame = fmr.Frame(*(reader.number(2) for _ in range(4)))
    count = reader.number()
    reader.number()  # reserved
    how.limits.check_views(count)
    views = [
        replace(read_view_2005(reader, frame, layout, how, notes), fields=fields)
        for _ in range(count)
    ]
    fmr.check_end(data, reader.at, declared, notes)
    return TemplateRecord(CODEC.name, tuple(views), tuple(notes))


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and what they could not hold."""
    notes: list[str] = []
    frame = fmr.one_frame(record)
    views = fmr.numbered(record)
    body = b"".join(write_view_2005(view, LAYOUT, notes) for view in views)
    total = HEADER_BYTES + len(body)
    length = total.to_bytes(2, "big") if total < LONG_LENGTH else (total + 4).to_bytes(6, "big")
    head = fmr.MAGIC + VERSIONS[0] + length + bytes(6)  # owner, type and device unknown
    head += frame_bytes(frame) + bytes([len(views), 0])
    return Encoded(head + body, tuple(notes))


def product_fields(reader: ByteReader, certification: int = 0) -> tuple[tuple[str, str], ...]:
    """Read who made a record and the device that took the print, in words; nothing for zeros.

    `certification` is how many bytes stand between the two.
    """
    owner, kind = reader.number(2), reader.number(2)
    reader.take(certification)
    device = reader.number(2)
    fields = []
    if owner or kind:
        fields.append(("product", f"0x{owner:04x} 0x{kind:04x}"))
    if device:
        fields.append(("capture device", f"0x{device:04x}"))
    return tuple(fields)


def _recognises(data: bytes) -> bool:
    magic, version = data[:4], data[4:8]
    return magic == fmr.MAGIC and version in VERSIONS and is_ansi_2004(data)


CODEC: Final = Codec(
    "ansi2004", "ANSI/INCITS 378-2004", (".ansi", ".ansi2004"), _recognises, decode, encode
)
