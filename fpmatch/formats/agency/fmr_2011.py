"""Finger minutiae records of ISO/IEC 19794-2:2011 and ANSI/INCITS 378-2009.

Both begin alike. Each view has its own size and resolution; 254 and 255 are an unknown quality.

ISO's views have a length, the time of their capture, and any number of qualities and certificates;
angles have 256 steps of a turn, and minutiae without quality take five bytes. ANSI's angles have
180 steps of two degrees. Its amendment 1 of 2010 differs in its version and in more finger codes,
and is read as well.
"""

from __future__ import annotations

import struct
from functools import partial
from typing import TYPE_CHECKING, Final

from fpmatch.base.plugins import FMR_SIGNATURE
from fpmatch.formats import fmr
from fpmatch.formats.fmr import product_fields
from fpmatch.formats.fmr_reader import (
    ANSI_STEPS,
    ISO_STEPS,
    Frame,
    Layout,
    RecordReader,
    fills,
)
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

if TYPE_CHECKING:
    from fpmatch.formats.record import View

VERSION: Final = b"030\x00"
AMENDED: Final = b"035\x00"
ISO_HEADER_BYTES: Final = 15
ANSI_HEADER_BYTES: Final = 21
ANSI_VIEW_BYTES: Final = 17  # before the minutiae
MOST_ISO_VIEWS: Final = 176  # sixteen of each finger code
FEWEST_VIEW_BYTES: Final = 34  # of an ISO view without minutiae
NO_DATE: Final = b"\xff" * 9
QUALITY_BLOCK_BYTES: Final = 5
CERTIFICATE_BYTES: Final = 3
ISO: Final = Layout("iso2011", ISO_STEPS, is_older=False)
ANSI: Final = Layout("ansi2009", ANSI_STEPS, product_bytes=7, is_older=False)


def decode_iso(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in a record, or raise TemplateError."""
    reader = RecordReader(data, options, ISO, VERSION)
    declared, count, certified = reader.numbers("IHB")
    return reader.record(
        ISO.name, declared, count, lambda: _read_iso_view(reader, certified=certified != 0)
    )


def encode_iso(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold."""
    notes: list[str] = []
    views = fmr.numbered(record, MOST_ISO_VIEWS)
    body = b"".join(_write_iso_view(view, notes) for view in views)
    head = struct.pack(">IHB", ISO_HEADER_BYTES + len(body), len(views), 0)
    return Encoded(FMR_SIGNATURE + VERSION + head + body, tuple(notes))


def _is_ansi(data: bytes) -> bool:
    """Distinguish ANSI/INCITS 378-2009 from ISO/IEC 19794-2:2011, which begin alike.

    The layout of the former fills `data`, or the first view would be shorter than any of the
    latter, or longer than the record.
    """
    if data[4:8] == AMENDED or fills(data, ANSI_HEADER_BYTES, ANSI_VIEW_BYTES):
        return True
    declared, length = (int.from_bytes(data[at : at + 4], "big") for at in (8, ISO_HEADER_BYTES))
    return not FEWEST_VIEW_BYTES <= length <= declared - ISO_HEADER_BYTES


def _read_iso_view(reader: RecordReader, *, certified: bool) -> View:
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


def _write_iso_view(view: View, notes: list[str]) -> bytes:
    frame = Frame.of(view.template, bits=14)
    quality = b"\x00"
    if view.quality is not None:
        quality = bytes([1, fmr.quality_of(view)]) + fmr.NO_ALGORITHM
    size = 6 if view.quality_known else 5
    place = struct.pack(
        ">BBHHBHHB",
        *(view.finger & 0xFF, view.number, frame.per_cm_x, frame.per_cm_y),
        *(view.impression & 0xFF, frame.width, frame.height, size << 4),
    )
    minutiae = fmr.write_view(view, ISO, notes, size=size)
    rest = NO_DATE + bytes(5) + quality + place + minutiae
    return (4 + len(rest)).to_bytes(4, "big") + rest


def decode_ansi(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in a record of the standard or its amendment, or raise TemplateError."""
    reader = RecordReader(data, options, ANSI, VERSION, AMENDED)
    declared = reader.number(4)
    return fmr.decode_views(reader, declared, product_fields(reader, certification=1))


CODECS: Final = {
    ISO.name: (lambda data: not _is_ansi(data), decode_iso, encode_iso),
    ANSI.name: (_is_ansi, decode_ansi, partial(fmr.encode, layout=ANSI, version=VERSION)),
}
