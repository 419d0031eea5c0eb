"""Finger minutiae records of ISO/IEC 19794-2:2011.

Each view has its own size and resolution, the time of its capture, and any number of qualities and
certificates. Whole pixels, angles in 256 steps of a turn, 255 minutiae a view; minutiae without
quality take five bytes.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Final

from fpmatch.binary_records import ByteReader
from fpmatch.errors import TemplateError
from fpmatch.formats import fmr
from fpmatch.formats.codec import Codec
from fpmatch.formats.fmr_header import MAGIC, Frame
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

if TYPE_CHECKING:
    from fpmatch.formats.record import View

VERSION: Final = b"030\x00"
HEADER_BYTES: Final = 15
FEWEST_VIEW_BYTES: Final = 34  # of a view without minutiae
NO_DATE: Final = b"\xff" * 9
QUALITY_BLOCK_BYTES: Final = 5
CERTIFICATE_BYTES: Final = 3
NO_ALGORITHM: Final = bytes(4)
MOST_VIEWS: Final = 176  # sixteen of each finger code
LAYOUT: Final = fmr.Layout("iso2011", fmr.ISO_STEPS, zero_is_unknown=False)


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in a record, or raise TemplateError."""
    reader = fmr.RecordReader(data, options, LAYOUT, VERSION)
    declared, count, certified = reader.numbers("IHB")
    return reader.record(
        CODEC.name, declared, count, lambda: _read_view(reader, certified=certified != 0)
    )


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold."""
    notes: list[str] = []
    views = fmr.numbered(record, MOST_VIEWS)
    body = b"".join(_write_view(view, notes) for view in views)
    head = struct.pack(">IHB", HEADER_BYTES + len(body), len(views), 0)
    return Encoded(MAGIC + VERSION + head + body, tuple(notes))


def is_iso_2011(data: bytes) -> bool:
    """Distinguish ISO/IEC 19794-2:2011 from ANSI/INCITS 378-2009, which begin alike.

    Each view of the former begins with its length, and header and views add up to the length of
    the record. Truncated data are judged by the part present.
    """
    reader = ByteReader(data, TemplateError, len(MAGIC + VERSION))
    if reader.left < HEADER_BYTES + 4 - reader.at:
        return False
    declared, count, certified = reader.numbers("IHB")
    if not 0 < count <= MOST_VIEWS or certified > 1:
        return False
    for _ in range(count):
        if reader.left < 4:
            return True
        length = reader.number(4)
        if length < FEWEST_VIEW_BYTES or reader.at - 4 + length > declared:
            return False
        reader.at += length - 4
    return bool(reader.at == declared)


def _read_view(reader: fmr.RecordReader, *, certified: bool) -> View:
    start = reader.at
    length, year, month, day, technology, vendor, device = reader.numbers("IHBB5xBHH")
    qualities = [reader.take(QUALITY_BLOCK_BYTES)[0] for _ in range(reader.number())]
    if certified:
        reader.take(CERTIFICATE_BYTES * reader.number())
    finger, number, per_cm_x, per_cm_y, impression = reader.numbers("BBHHB")
    width, height, size = reader.numbers("HHB")
    dated = 1 <= month <= 12 and 1 <= day <= 31
    fields = {
        "captured": f"{year:04d}-{month:02d}-{day:02d}" if dated else "",
        "sensor technology": str(technology or ""),
        "capture device": f"0x{vendor:04x} 0x{device:04x}" if vendor or device else "",
    }
    view = reader.view(
        Frame(width, height, per_cm_x, per_cm_y),
        size=size >> 4,
        quality=next((quality for quality in qualities if quality <= 100), None),
        finger=finger,
        number=number,
        impression=impression,
        fields=tuple((name, text) for name, text in fields.items() if text),
    )
    if reader.at != start + length:
        reader.notes.append(f"a view declares {length} bytes and has {reader.at - start}")
    return view


def _write_view(view: View, notes: list[str]) -> bytes:
    frame = Frame.of(view.template, bits=14)
    quality = b"\x00"
    if view.quality is not None:
        quality = bytes([1, fmr.quality_of(view)]) + NO_ALGORITHM
    size = 6 if view.quality_known else 5
    place = struct.pack(
        ">BBHHBHHB",
        *(view.finger & 0xFF, view.number, frame.per_cm_x, frame.per_cm_y),
        *(view.impression & 0xFF, frame.width, frame.height, size << 4),
    )
    minutiae = fmr.write_view(view, LAYOUT, notes, size=size)
    rest = NO_DATE + bytes(5) + quality + place + minutiae
    return (4 + len(rest)).to_bytes(4, "big") + rest


def _recognises(data: bytes) -> bool:
    return data.startswith(MAGIC + VERSION) and is_iso_2011(data)


CODEC: Final = Codec("iso2011", "ISO/IEC 19794-2:2011", (".iso2011",), _recognises, decode, encode)
