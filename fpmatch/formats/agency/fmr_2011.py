"""Finger minutiae records of ISO/IEC 19794-2:2011 and ANSI/INCITS 378-2009, which are only read.

Both begin alike. Each view has its own size and resolution; 254 and 255 are an unknown quality.

ISO's views have a length, the time of their capture, and any number of qualities and certificates;
angles have 256 steps of a turn, and minutiae without quality take five bytes. ANSI's angles have
180 steps of two degrees. Its amendment 1 of 2010 differs in its version and in more finger codes,
and is read as well.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.formats.fmr import ANSI_STEPS, ISO_STEPS, Layout, RecordReader

if TYPE_CHECKING:
    from fpmatch.formats.record import ReadingOptions, TemplateRecord, View

VERSION: Final = b"030\x00"
AMENDED: Final = b"035\x00"
ISO_HEADER_BYTES: Final = 15
FEWEST_VIEW_BYTES: Final = 34  # of an ISO view without minutiae
QUALITY_BLOCK_BYTES: Final = 5
CERTIFICATE_BYTES: Final = 3
ISO: Final = Layout("iso2011", ISO_STEPS, is_older=False)
ANSI: Final = Layout("ansi2009", ANSI_STEPS, is_older=False)


def is_iso(data: bytes) -> bool:
    """Distinguish ISO/IEC 19794-2:2011 from ANSI/INCITS 378-2009, which begin alike.

    The first view of the former states a length, that of the rest of the record if it is the only
    one, and else no more.
    """
    bounds = ((8, 12), (12, 14), (ISO_HEADER_BYTES, ISO_HEADER_BYTES + 4))
    declared, views, length = (int.from_bytes(data[a:b], "big") for a, b in bounds)
    rest = declared - ISO_HEADER_BYTES
    return length == rest if views == 1 else FEWEST_VIEW_BYTES <= length <= rest


def is_ansi(data: bytes) -> bool:
    """Return whether a record is one of ANSI/INCITS 378-2009 or its amendment."""
    return data[4:8] == AMENDED or not is_iso(data)


def decode_iso(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in a record, or raise TemplateError."""
    reader = RecordReader(data, options, ISO, VERSION)
    declared, views, certified = reader.numbers("IHB")
    return reader.record(declared, views, lambda: _iso_view(reader, certified=certified != 0))


def _iso_view(reader: RecordReader, *, certified: bool) -> View:
    start = reader.at
    (length,) = reader.numbers("I14x")  # then the date and the device
    qualities = [reader.take(QUALITY_BLOCK_BYTES)[0] for _ in range(reader.number())]
    if certified:
        reader.take(CERTIFICATE_BYTES * reader.number())
    finger, per_cm_x, per_cm_y, impression = reader.numbers("BxHHB")
    width, height, size = reader.numbers("HHB")
    view = reader.view(
        (width, height, per_cm_x, per_cm_y),
        size=size >> 4,
        quality=next((quality for quality in qualities if quality <= 100), None),
        finger=finger,
        impression=impression,
    )
    if reader.at != start + length:
        reader.notes.append(f"a view declares {length} bytes and has {reader.at - start}")
    return view


def decode_ansi(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in a record of the standard or its amendment, or raise TemplateError."""
    reader = RecordReader(data, options, ANSI, VERSION, AMENDED)
    declared, views = reader.numbers("I7xBx")

    def view() -> View:
        finger, impression, quality = reader.numbers("BxBB4x")
        frame = reader.numbers("4H")
        return reader.view(frame, quality=quality, finger=finger, impression=impression)

    return reader.record(declared, views, view)
