"""Finger minutiae records of ISO/IEC 19794-2:2011 and ANSI/INCITS 378-2009, which are only read.

Both begin alike. Each view has its own size and resolution; 254 and 255 are an unknown quality.

ISO's views have a length, the time of their capture, and any number of qualities and certificates;
angles have 256 steps of a turn, and minutiae without quality take five bytes. ANSI's angles have
180 steps of two degrees. Its amendment 1 of 2010 differs in its version and in more finger codes,
and is read as well.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.formats.fmr import ANSI_STEPS, ISO_STEPS, Layout, RecordReader, fills

if TYPE_CHECKING:
    from fpmatch.formats.record import ReadingOptions, TemplateRecord, View

VERSION: Final = b"030\x00"
AMENDED: Final = b"035\x00"
ISO_HEADER_BYTES: Final = 15
ANSI_HEADER_BYTES: Final = 21
ANSI_VIEW_BYTES: Final = 17  # before the minutiae
FEWEST_VIEW_BYTES: Final = 34  # of an ISO view without minutiae
QUALITY_BLOCK_BYTES: Final = 5
CERTIFICATE_BYTES: Final = 3
ISO: Final = Layout("iso2011", ISO_STEPS, is_older=False)
ANSI: Final = Layout("ansi2009", ANSI_STEPS, is_older=False)


def is_ansi(data: bytes) -> bool:
    """Distinguish ANSI/INCITS 378-2009 from ISO/IEC 19794-2:2011, which begin alike.

    The layout of the former fills `data`, or the first view would be shorter than any of the
    latter, or longer than the record.
    """
    if data[4:8] == AMENDED or fills(data, ANSI_HEADER_BYTES, ANSI_VIEW_BYTES):
        return True
    declared, length = (int.from_bytes(data[at : at + 4], "big") for at in (8, ISO_HEADER_BYTES))
    return not FEWEST_VIEW_BYTES <= length <= declared - ISO_HEADER_BYTES


def is_iso(data: bytes) -> bool:
    """Return whether a record of version 030 is one of ISO."""
    return not is_ansi(data)


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
    finger, number, per_cm_x, per_cm_y, impression = reader.numbers("BBHHB")
    width, height, size = reader.numbers("HHB")
    view = reader.view(
        (width, height, per_cm_x, per_cm_y),
        size=size >> 4,
        quality=next((quality for quality in qualities if quality <= 100), None),
        finger=finger,
        number=number,
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
        finger, number, impression, quality = reader.numbers("4B4x")
        about = {"finger": finger, "number": number, "impression": impression}
        return reader.view(reader.numbers("4H"), quality=quality, **about)

    return reader.record(declared, views, view)
