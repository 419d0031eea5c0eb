"""Finger minutiae records of ISO/IEC 19794-2:2005 and ANSI/INCITS 378-2004.

Both have one size and resolution for all views, whole pixels, 255 minutiae in a view, and 0 for an
unknown quality. ANSI has a longer header and angles in 180 steps of a turn, ISO in 256. ISO's
compact formats for cards, which have no header, are not read.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

from fpmatch.formats import fmr
from fpmatch.formats.codec import Codec
from fpmatch.formats.fmr_header import MAGIC, Frame, device_fields, product_fields
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

if TYPE_CHECKING:
    from fpmatch.formats.record import View

ISO_HEADER_BYTES: Final = 24
ANSI_HEADER_BYTES: Final = 26
VIEW_BYTES: Final = 4  # before the minutiae
VERSION: Final = b" 20\x00"
ANSI_VERSIONS: Final = (VERSION, b"020\x00")  # the second in early files only
LONG_LENGTH: Final = 2**16  # from which on ANSI's length takes six bytes
ISO: Final = fmr.Layout("iso2005", fmr.ISO_STEPS, zero_is_unknown=True)
ANSI: Final = fmr.Layout("ansi2004", fmr.ANSI_STEPS, zero_is_unknown=True)


def decode_iso(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in an ISO record, or raise TemplateError."""
    reader = fmr.RecordReader(data, options, ISO, VERSION)
    declared, device = reader.numbers("IH")
    return _decode(reader, declared, device_fields(device))


def decode_ansi(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in an ANSI record, or raise TemplateError."""

    def read(layout: fmr.Layout) -> TemplateRecord:
        reader = fmr.RecordReader(data, options, layout, *ANSI_VERSIONS)
        declared = reader.number(6 if _is_long(data) else 2)
        return _decode(reader, declared, product_fields(reader))

    return fmr.decode_ansi(read, ANSI)


def _decode(
    reader: fmr.RecordReader, declared: int, fields: tuple[tuple[str, str], ...]
) -> TemplateRecord:
    """Read the rest of a record, from its frame on."""
    frame = Frame(*reader.numbers("4H"))
    (count,) = reader.numbers("Bx")

    def view() -> View:
        finger, both, quality = reader.numbers("3B")
        about = {"finger": finger, "number": both >> 4, "impression": both & 0x0F}
        return reader.view(frame, quality=quality, fields=fields, **about)

    return reader.record(reader.layout.name, declared, count, view)


def encode(record: TemplateRecord, *, layout: fmr.Layout) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold."""
    notes: list[str] = []
    frame = Frame.shared(record)
    views = fmr.numbered(record)
    body = b"".join(_write_view(view, layout, notes) for view in views)
    if layout is ISO:
        head = (ISO_HEADER_BYTES + len(body)).to_bytes(4, "big") + bytes(2)  # device unknown
    else:
        total = ANSI_HEADER_BYTES + len(body)
        head = total.to_bytes(2, "big") if total < LONG_LENGTH else (total + 4).to_bytes(6, "big")
        head += bytes(6)  # owner, type and device unknown
    head += frame.to_bytes() + bytes([len(views), 0])
    return Encoded(MAGIC + VERSION + head + body, tuple(notes))


def _write_view(view: View, layout: fmr.Layout, notes: list[str]) -> bytes:
    impression, number = view.impression, view.number
    if not 0 <= impression < 16:
        notes.append(f"impression type {impression} written as 0, live plain")
        impression = 0
    if number > 15:
        notes.append(f"view number {number} written as 15")
        number = 15
    head = bytes([view.finger & 0xFF, number << 4 | impression, fmr.quality_of(view)])
    return head + fmr.write_view(view, layout, notes)


def _is_ansi(data: bytes) -> bool:
    """Distinguish ANSI from ISO records, which begin alike, by the layout that fills `data`.

    Where both or neither do, as in the beginning of a file, the length decides. ISO's has four
    bytes, ANSI's two, of 26 at least, or six, of which the first two are 0 and the others a number
    over 65,535.
    """
    iso = fmr.fills(data, ISO_HEADER_BYTES, VIEW_BYTES)
    ansi = fmr.fills(data, ANSI_HEADER_BYTES + 4 * _is_long(data), VIEW_BYTES)
    if iso != ansi:
        return ansi
    first, second = int.from_bytes(data[8:10], "big"), int.from_bytes(data[10:12], "big")
    return first >= ANSI_HEADER_BYTES or (first == 0 and 0 < second < ISO_HEADER_BYTES)


def _is_long(data: bytes) -> bool:
    """Return whether the length of an ANSI record has six bytes."""
    return data[8:10] == bytes(2) and int.from_bytes(data[10:14], "big") >= LONG_LENGTH


def _recognises_iso(data: bytes) -> bool:
    return data.startswith(MAGIC + VERSION) and not _is_ansi(data)


def _recognises_ansi(data: bytes) -> bool:
    return data[:4] == MAGIC and data[4:8] in ANSI_VERSIONS and _is_ansi(data)


ISO_CODEC: Final = Codec(
    ISO.name,
    "ISO/IEC 19794-2:2005",
    (".iso", ".ist", ".fmr"),
    _recognises_iso,
    decode_iso,
    partial(encode, layout=ISO),
)
ANSI_CODEC: Final = Codec(
    ANSI.name,
    "ANSI/INCITS 378-2004",
    (".ansi", ".ansi2004"),
    _recognises_ansi,
    decode_ansi,
    partial(encode, layout=ANSI),
)
