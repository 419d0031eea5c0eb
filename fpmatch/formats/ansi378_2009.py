"""Finger minutiae records of ANSI/INCITS 378-2009 and its amendment 1 of 2010.

Each view has its own size and resolution. Angles have 180 steps of two degrees; 254 and 255 are an
unknown quality. The amendment differs in its version and in more finger codes. A draft of 2007 has
a header one byte shorter and is read as well.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

from fpmatch.errors import FpmatchError
from fpmatch.formats import fmr
from fpmatch.formats.codec import Codec
from fpmatch.formats.fmr_header import MAGIC, Frame, product_fields
from fpmatch.formats.iso19794_2_2011 import is_iso_2011
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

if TYPE_CHECKING:
    from fpmatch.formats.record import View

VERSION: Final = b"030\x00"
AMENDED: Final = b"035\x00"
HEADER_BYTES: Final = 21
UNKNOWN_QUALITY: Final = 254
NO_QUALITY_ALGORITHM: Final = bytes(4)
LAYOUT: Final = fmr.Layout("ansi2009", fmr.ANSI_STEPS, zero_is_unknown=False)


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in a record, or raise TemplateError."""
    return fmr.decode_ansi(lambda layout: _decode(data, options, layout), LAYOUT)


def _decode(data: bytes, options: ReadingOptions, layout: fmr.Layout) -> TemplateRecord:
    """Return a record, read by the draft of 2007 if only that fills the file."""
    try:
        record, end = _read(data, options, layout, certification=1)
    except FpmatchError:
        draft = _draft(data, options, layout)
        if draft is None:
            raise
        return draft
    if end != len(data) and record.format == CODEC.name:
        return _draft(data, options, layout) or record
    return record


def _draft(data: bytes, options: ReadingOptions, layout: fmr.Layout) -> TemplateRecord | None:
    """Return a record of the draft of 2007, None if `data` are not exactly one."""
    try:
        record, end = _read(data, options, layout, certification=0)
    except FpmatchError:
        return None
    note = "the layout is that of the draft of 2007"
    return replace(record, notes=(note, *record.notes)) if end == len(data) else None


def _read(
    data: bytes, options: ReadingOptions, layout: fmr.Layout, *, certification: int
) -> tuple[TemplateRecord, int]:
    """Return a record and its end; `certification` bytes precede the device."""
    reader = fmr.RecordReader(data, options, layout, VERSION, AMENDED)
    declared = reader.number(4)
    fields = product_fields(reader, certification)
    (count,) = reader.numbers("Bx")

    def view() -> View:
        finger, number, impression, quality = reader.numbers("4B4x")
        about = {"finger": finger, "number": number, "impression": impression}
        return reader.view(Frame(*reader.numbers("4H")), quality=quality, fields=fields, **about)

    name = AMENDED_CODEC.name if data[4:8] == AMENDED else CODEC.name
    return reader.record(name, declared, count, view), reader.at


def encode(record: TemplateRecord, *, version: bytes) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold."""
    notes: list[str] = []
    views = fmr.numbered(record)
    body = b"".join(_write_view(view, notes) for view in views)
    head = MAGIC + version + (HEADER_BYTES + len(body)).to_bytes(4, "big")
    head += bytes(7) + bytes([len(views), 0])  # owner, type, certification and device unknown
    return Encoded(head + body, tuple(notes))


def _write_view(view: View, notes: list[str]) -> bytes:
    quality = UNKNOWN_QUALITY if view.quality is None else fmr.quality_of(view)
    head = bytes([view.finger & 0xFF, view.number, view.impression & 0xFF, quality])
    frame = Frame.of(view.template).to_bytes()
    return head + NO_QUALITY_ALGORITHM + frame + fmr.write_view(view, LAYOUT, notes)


def _recognises(data: bytes) -> bool:
    return data.startswith(MAGIC + VERSION) and not is_iso_2011(data)


def _recognises_amended(data: bytes) -> bool:
    return data.startswith(MAGIC + AMENDED)


CODEC: Final = Codec(
    "ansi2009",
    "ANSI/INCITS 378-2009",
    (".ansi2009",),
    _recognises,
    decode,
    partial(encode, version=VERSION),
)
AMENDED_CODEC: Final = Codec(
    "ansi2009am1",
    "ANSI/INCITS 378-2009/AM1",
    (".ansi2009am1",),
    _recognises_amended,
    decode,
    partial(encode, version=AMENDED),
)
