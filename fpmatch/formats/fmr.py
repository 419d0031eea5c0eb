"""Finger minutiae records of ISO/IEC 19794-2:2005 and ANSI/INCITS 378-2004.

Both have one size and resolution for all views, 255 minutiae in a view, and 0 for an unknown
quality; ANSI's header is longer. ISO's compact formats for cards, which have no header, are not
read.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.plugins import FMR_SIGNATURE
from fpmatch.errors import TemplateError
from fpmatch.formats.codec import Codec, check_fits, fit_minutiae, whole_pixels, whole_steps
from fpmatch.formats.fmr_reader import (
    ANSI_STEPS,
    ISO_STEPS,
    KIND_SHIFT,
    MINUTIA,
    Frame,
    Layout,
    RecordReader,
    fills,
)
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View

if TYPE_CHECKING:
    from fpmatch.base.binary_records import ByteReader

MOST_MINUTIAE: Final = 255  # largest count in one byte
MOST_VIEWS: Final = 255
ISO_HEADER_BYTES: Final = 24
ANSI_HEADER_BYTES: Final = 26
VIEW_BYTES: Final = 4  # before the minutiae
VERSION: Final = b" 20\x00"
NO_ALGORITHM: Final = bytes(4)  # of quality
UNKNOWN_QUALITY: Final = 254
ANSI_VERSIONS: Final = (VERSION, b"020\x00")  # the second in early files only
LONG_LENGTH: Final = 2**16  # from which on ANSI's length takes six bytes
ISO: Final = Layout("iso2005", ISO_STEPS, product_bytes=2)
ANSI: Final = Layout("ansi2004", ANSI_STEPS, length_bytes=2, product_bytes=6)


def write_view(view: View, layout: Layout, notes: list[str], *, size: int = 6) -> bytes:
    """Return what `RecordReader.view` reads; raises TemplateError if extended data are too long."""
    template = view.template
    minutiae = fit_minutiae(template, MOST_MINUTIAE, notes)
    rows = np.zeros(len(minutiae), MINUTIA[size])
    x = whole_pixels(minutiae.x, template.width)
    rows["x"] = x | (minutiae.kind.astype(np.int64) << KIND_SHIFT)
    rows["y"] = whole_pixels(minutiae.y, template.height)
    rows["angle"] = whole_steps(minutiae.angle, layout.angle_steps)
    if size == 6 and view.quality_known:
        rows["quality"] = np.maximum(minutiae.quality, 1 if layout.is_older else 0)
    elif size == 6:
        rows["quality"] = 0 if layout.is_older else UNKNOWN_QUALITY
    extended = b""
    if view.extended is not None and view.extended.data:
        if view.extended.layout != layout.name:
            notes.append(f"extended data of {view.extended.layout} dropped")
        elif len(minutiae) < len(template.minutiae):
            notes.append("extended data dropped, as they count the minutiae that there were")
        else:
            extended = view.extended.data
    check_fits(len(extended), 16, "extended data")
    return bytes([len(rows)]) + rows.tobytes() + len(extended).to_bytes(2, "big") + extended


def quality_of(view: View) -> int:
    """Return the quality of a view, 0 to 100; if unknown, the mean of its minutiae."""
    if view.quality is not None:
        return min(100, max(0, view.quality))
    quality = view.template.minutiae.quality
    return round(float(quality.mean())) if quality.size else 0


def numbered(record: TemplateRecord, most: int = MOST_VIEWS) -> list[View]:
    """Return the views, renumbered from 0 for each finger; raises TemplateError if over `most`."""
    if len(record.views) > most:
        raise TemplateError(f"the format holds {most} prints at most")
    fingers = [view.finger for view in record.views]
    return [
        replace(view, number=fingers[:k].count(view.finger)) for k, view in enumerate(record.views)
    ]


def product_fields(reader: ByteReader, certification: int = 0) -> tuple[tuple[str, str], ...]:
    """Read product and capture device, with `certification` bytes between; zeros are unknown."""
    owner, kind, device = reader.numbers(f"HH{certification}xH")
    product = (("product", f"0x{owner:04x} 0x{kind:04x}"),) if owner or kind else ()
    return product + device_fields(device)


def device_fields(device: int) -> tuple[tuple[str, str], ...]:
    """Return the field of a capture device; 0 is unknown."""
    return (("capture device", f"0x{device:04x}"),) if device else ()


def decode_iso(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in an ISO record, or raise TemplateError."""
    reader = RecordReader(data, options, ISO, VERSION)
    declared, device = reader.numbers("IH")
    return decode_views(reader, declared, device_fields(device))


def decode_ansi(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in an ANSI record, or raise TemplateError."""
    reader = RecordReader(data, options, ANSI, *ANSI_VERSIONS)
    declared = reader.number(6 if _is_long(data) else 2)
    return decode_views(reader, declared, product_fields(reader))


def decode_views(
    reader: RecordReader, declared: int, fields: tuple[tuple[str, str], ...]
) -> TemplateRecord:
    """Read the rest of a record, of `declared` bytes in all, behind its product."""
    shared = Frame(*reader.numbers("4H")) if reader.layout.is_older else None
    (views,) = reader.numbers("Bx")

    def view() -> View:
        if shared is not None:
            finger, both, quality = reader.numbers("3B")
            number, impression, frame = both >> 4, both & 0x0F, shared
        else:
            finger, number, impression, quality = reader.numbers("4B4x")
            frame = Frame(*reader.numbers("4H"))
        about = {"finger": finger, "number": number, "impression": impression, "fields": fields}
        return reader.view(frame, quality=quality, **about)

    return reader.record(reader.layout.name, declared, views, view)


def encode(record: TemplateRecord, *, layout: Layout, version: bytes = VERSION) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold; its product is unknown."""
    notes: list[str] = []
    frame = Frame.shared(record).to_bytes() if layout.is_older else b""
    views = numbered(record)
    rest = bytes(layout.product_bytes) + frame + bytes([len(views), 0])
    rest += b"".join(_write_view(view, layout, notes) for view in views)
    size = layout.length_bytes
    length = len(FMR_SIGNATURE + version) + size + len(rest)
    if length >= 1 << 8 * size:
        size, length = 6, length + 6 - size
    return Encoded(FMR_SIGNATURE + version + length.to_bytes(size, "big") + rest, tuple(notes))


def _write_view(view: View, layout: Layout, notes: list[str]) -> bytes:
    impression, number = view.impression, view.number
    if not layout.is_older:
        quality = UNKNOWN_QUALITY if view.quality is None else quality_of(view)
        head = bytes([view.finger & 0xFF, number, impression & 0xFF, quality]) + NO_ALGORITHM
        return head + Frame.of(view.template).to_bytes() + write_view(view, layout, notes)
    if not 0 <= impression < 16:
        notes.append(f"impression type {impression} written as 0, live plain")
        impression = 0
    if number > 15:
        notes.append(f"view number {number} written as 15")
        number = 15
    head = bytes([view.finger & 0xFF, number << 4 | impression, quality_of(view)])
    return head + write_view(view, layout, notes)


def _is_ansi(data: bytes) -> bool:
    """Distinguish ANSI from ISO records, which begin alike, by the layout that fills `data`.

    Where both or neither do, as in the beginning of a file, the length decides. ISO's has four
    bytes, ANSI's two, of 26 at least, or six, of which the first two are 0 and the others a number
    over 65,535.
    """
    iso = fills(data, ISO_HEADER_BYTES, VIEW_BYTES)
    ansi = fills(data, ANSI_HEADER_BYTES + 4 * _is_long(data), VIEW_BYTES)
    if iso != ansi:
        return ansi
    first, second = int.from_bytes(data[8:10], "big"), int.from_bytes(data[10:12], "big")
    return first >= ANSI_HEADER_BYTES or (first == 0 and 0 < second < ISO_HEADER_BYTES)


def _is_long(data: bytes) -> bool:
    """Return whether the length of an ANSI record has six bytes."""
    return data[8:10] == bytes(2) and int.from_bytes(data[10:14], "big") >= LONG_LENGTH


def _recognises_iso(data: bytes) -> bool:
    return data.startswith(FMR_SIGNATURE + VERSION) and not _is_ansi(data)


def _recognises_ansi(data: bytes) -> bool:
    return data[:4] == FMR_SIGNATURE and data[4:8] in ANSI_VERSIONS and _is_ansi(data)


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
