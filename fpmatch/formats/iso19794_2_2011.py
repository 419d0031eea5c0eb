"""Finger minutiae records of ISO/IEC 19794-2:2011.

Each view has its own size and resolution, the time of its capture, and any number of qualities and
certificates. Whole pixels, angles in 256 steps of a turn, 255 minutiae a view; minutiae without
quality take five bytes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from fpmatch.formats import fmr, fmr_header
from fpmatch.formats.codec import Codec
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

if TYPE_CHECKING:
    from fpmatch.formats.record import View

VERSION: Final = b"030\x00"
HEADER_BYTES: Final = 15
FEWEST_VIEW_BYTES: Final = 34  # of a view without minutiae
DATE_BYTES: Final = 9
NO_DATE: Final = b"\xff" * DATE_BYTES
QUALITY_BLOCK_BYTES: Final = 5
CERTIFICATE_BYTES: Final = 3
NO_ALGORITHM: Final = bytes(4)
MOST_VIEWS: Final = 176  # sixteen of each finger code
LAYOUT: Final = fmr.Layout("iso2011", fmr.ISO_STEPS, zero_is_unknown=False)


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in a record, or raise TemplateError."""
    reader, notes = fmr_header.begin(data, VERSION), list[str]()
    declared = reader.number(4)
    count = reader.number(2)
    certified = reader.number() != 0
    options.limits.check_views(count)
    views = [_read_view(reader, options, notes, certified=certified) for _ in range(count)]
    fmr_header.check_end(data, reader.at, declared, notes)
    return TemplateRecord(CODEC.name, tuple(views), tuple(notes))


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold."""
    notes: list[str] = []
    views = fmr.numbered(record, MOST_VIEWS)
    body = b"".join(_write_view(view, notes) for view in views)
    head = fmr_header.MAGIC + VERSION + (HEADER_BYTES + len(body)).to_bytes(4, "big")
    return Encoded(head + len(views).to_bytes(2, "big") + bytes(1) + body, tuple(notes))


def is_iso_2011(data: bytes) -> bool:
    """Distinguish ISO/IEC 19794-2:2011 from ANSI/INCITS 378-2009, which begin alike.

    Each view of the former begins with its length, and header and views add up to the length of
    the record. Truncated data are judged by the part present.
    """
    reader = fmr_header.ByteReader(data, len(fmr_header.MAGIC + VERSION))
    if reader.left < HEADER_BYTES + 4 - reader.at:
        return False
    declared, count, certified = reader.number(4), reader.number(2), reader.number()
    if not 0 < count <= MOST_VIEWS or certified > 1:
        return False
    for _ in range(count):
        if reader.left < 4:
            return True
        length = reader.number(4)
        if length < FEWEST_VIEW_BYTES or reader.at - 4 + length > declared:
            return False
        reader.at += length - 4
    return reader.at == declared


def _read_view(
    reader: fmr_header.ByteReader, options: ReadingOptions, notes: list[str], *, certified: bool
) -> View:
    start = reader.at
    length = reader.number(4)
    date = reader.take(DATE_BYTES)
    technology, vendor, device = reader.number(), reader.number(2), reader.number(2)
    qualities = [reader.take(QUALITY_BLOCK_BYTES)[0] for _ in range(reader.number())]
    if certified:
        reader.take(CERTIFICATE_BYTES * reader.number())
    finger, number = reader.number(), reader.number()
    per_cm = reader.number(2), reader.number(2)
    impression = reader.number()
    frame = fmr_header.Frame(reader.number(2), reader.number(2), *per_cm)
    size = reader.number() >> 4
    view = fmr.read_view(reader, frame, LAYOUT, options, notes, size=size)
    if reader.at != start + length:
        notes.append(f"a view declares {length} bytes and has {reader.at - start}")
    known = [quality for quality in qualities if quality <= 100]
    return replace(
        view,
        finger=finger,
        number=number,
        impression=impression,
        quality=known[0] if known else None,
        fields=_fields(date, technology, vendor, device),
    )


def _fields(date: bytes, technology: int, vendor: int, device: int) -> tuple[tuple[str, str], ...]:
    """Return descriptions of capture date, sensor and device, where known."""
    fields = []
    year, month, day = int.from_bytes(date[:2], "big"), date[2], date[3]
    if 1 <= month <= 12 and 1 <= day <= 31:
        fields.append(("captured", f"{year:04d}-{month:02d}-{day:02d}"))
    if technology:
        fields.append(("sensor technology", str(technology)))
    if vendor or device:
        fields.append(("capture device", f"0x{vendor:04x} 0x{device:04x}"))
    return tuple(fields)


def _write_view(view: View, notes: list[str]) -> bytes:
    frame = fmr_header.Frame.of(view.template, bits=14)
    quality = b"\x00"
    if view.quality is not None:
        quality = bytes([1, fmr.quality_of(view)]) + NO_ALGORITHM
    size = fmr.SIX_BYTES.itemsize if view.quality_known else fmr.FIVE_BYTES.itemsize
    rest = NO_DATE + bytes(5) + quality + bytes([view.finger & 0xFF, view.number])
    rest += frame.per_cm_x.to_bytes(2, "big") + frame.per_cm_y.to_bytes(2, "big")
    rest += bytes([view.impression & 0xFF])
    rest += frame.width.to_bytes(2, "big") + frame.height.to_bytes(2, "big")
    rest += bytes([size << 4]) + fmr.write_view(view, LAYOUT, notes, size=size)
    return (4 + len(rest)).to_bytes(4, "big") + rest


def _recognises(data: bytes) -> bool:
    return data.startswith(fmr_header.MAGIC + VERSION) and is_iso_2011(data)


CODEC: Final = Codec("iso2011", "ISO/IEC 19794-2:2011", (".iso2011",), _recognises, decode, encode)
