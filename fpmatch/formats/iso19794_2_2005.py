"""Templates as finger minutiae records of ISO/IEC 19794-2:2005.

One size and resolution for all views; whole pixels, angles in 256 steps of a turn, 255 minutiae a
view. A quality of 0 means unknown. The compact formats for cards, which have no header, are not
read.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from fpmatch.formats import fmr
from fpmatch.formats.codec import Codec
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

if TYPE_CHECKING:
    from fpmatch.formats.byte_reader import ByteReader
    from fpmatch.formats.record import View

VERSION: Final = b" 20\x00"
HEADER_BYTES: Final = 24
LAYOUT: Final = fmr.Layout("iso2005", fmr.ISO_STEPS, zero_is_unknown=True)


def decode(data: bytes, how: ReadingOptions) -> TemplateRecord:
    """Return the prints that a record holds, or raise TemplateError."""
    reader, notes = fmr.begin(data, VERSION), list[str]()
    declared = reader.number(4)
    device = reader.number(2)
    frame = fmr.Frame(*(reader.number(2) for _ in range(4)))
    count = reader.number()
    reader.number()  # reserved
    how.limits.check_views(count)
    fields = (("capture device", f"0x{device:04x}"),) if device else ()
    views = [replace(_read_view(reader, frame, how, notes), fields=fields) for _ in range(count)]
    fmr.check_end(data, reader.at, declared, notes)
    return TemplateRecord(CODEC.name, tuple(views), tuple(notes))


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and what they could not hold."""
    notes: list[str] = []
    frame = fmr.one_frame(record)
    views = fmr.numbered(record)
    body = b"".join(write_view_2005(view, LAYOUT, notes) for view in views)
    head = fmr.MAGIC + VERSION + (HEADER_BYTES + len(body)).to_bytes(4, "big") + bytes(2)
    head += frame_bytes(frame) + bytes([len(views), 0])
    return Encoded(head + body, tuple(notes))


def frame_bytes(frame: fmr.Frame) -> bytes:
    """Return a frame as eight bytes of a header."""
    sides = (frame.width, frame.height, frame.per_cm_x, frame.per_cm_y)
    return b"".join(side.to_bytes(2, "big") for side in sides)


def write_view_2005(view: View, layout: fmr.Layout, notes: list[str]) -> bytes:
    """Return a view with its four-byte header, as the formats of 2004 and 2005 have it."""
    impression = view.impression
    if not 0 <= impression < 16:
        notes.append(f"impression type {impression} written as 0, live plain")
        impression = 0
    number = view.number
    if number > 15:
        notes.append(f"view number {number} written as 15")
        number = 15
    head = bytes([view.finger & 0xFF, number << 4 | impression, fmr.quality_of(view)])
    return head + fmr.write_view(view, layout, notes)


def read_view_2005(
    reader: ByteReader, frame: fmr.Frame, layout: fmr.Layout, how: ReadingOptions, notes: list[str]
) -> View:
    """Read a view with its four-byte header, as the formats of 2004 and 2005 have it."""
    finger, both, quality = reader.number(), reader.number(), reader.number()
    view = fmr.read_view(reader, frame, layout, how, notes)
    return replace(
        view,
        finger=finger,
        number=both >> 4,
        impression=both & 0x0F,
        quality=quality if quality <= 100 else None,
    )


def _read_view(reader: ByteReader, frame: fmr.Frame, how: ReadingOptions, notes: list[str]) -> View:
    return read_view_2005(reader, frame, LAYOUT, how, notes)


def _recognises(data: bytes) -> bool:
    return data.startswith(fmr.MAGIC + VERSION) and not is_ansi_2004(data)


def is_ansi_2004(data: bytes) -> bool:
    """Tell ANSI/INCITS 378-2004 from ISO/IEC 19794-2:2005, which begin alike.

    ISO's length has four bytes. ANSI's has two, of 26 at least, or six, of which the first two are
    0 and the next two the higher half of a length over 65,535.
    """
    first, second = int.from_bytes(data[8:10], "big"), int.from_bytes(data[10:12], "big")
    return first >= 26 or (first == 0 and second < HEADER_BYTES)


CODEC: Final = Codec(
    "iso2005", "ISO/IEC 19794-2:2005", (".iso", ".ist", ".fmr"), _recognises, decode, encode
)
