"""Templates as finger minutiae records of ANSI/INCITS 378-2009, and of its amendment 1 of 2010.

Each view has its own size and resolution. Angles have 180 steps of two degrees, qualities of 254
and 255 tell none. The amendment differs in its version and in more finger codes. A draft of 2007
that was used for a time has a header one byte shorter and is read as well.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from fpmatch.errors import FpmatchError
from fpmatch.formats import fmr
from fpmatch.formats.ansi378_2004 import product_fields
from fpmatch.formats.codec import Codec
from fpmatch.formats.iso19794_2_2005 import frame_bytes
from fpmatch.formats.iso19794_2_2011 import is_iso_2011
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord

if TYPE_CHECKING:
    from fpmatch.formats.byte_reader import ByteReader
    from fpmatch.formats.record import View

VERSION: Final = b"030\x00"
AMENDED: Final = b"035\x00"
HEADER_BYTES: Final = 21
UNKNOWN_QUALITY: Final = 254
NO_QUALITY_ALGORITHM: Final = bytes(4)
LAYOUT: Final = fmr.Layout("ansi2009", fmr.ANSI_STEPS, zero_is_unknown=False)


def decode(data: bytes, how: ReadingOptions) -> TemplateRecord:
    """Return the prints that a record holds, or raise TemplateError."""
    return fmr.decode_ansi(lambda layout: _decode(data, how, layout), LAYOUT)


def _decode(data: bytes, how: ReadingOptions, layout: fmr.Layout) -> TemplateRecord:
    """Return what a record holds, by the draft of 2007 where only that fills the file."""
    try:
        record, end = _read(data, how, layout, certification=1)
    except FpmatchError:
        draft = _draft(data, how, layout)
        if draft is None:
            raise
        return draft
    if end != len(data) and record.format == CODEC.name:
        return _draft(data, how, layout) or record
    return record


def _draft(data: bytes, how: ReadingOptions, layout: fmr.Layout) -> TemplateRecord | None:
    """Return what `data` holds by the draft of 2007, None where it does not hold just that."""
    try:
        record, end = _read(data, how, layout, certification=0)
    except FpmatchError:
        return None
    note = "the layout is that of the draft of 2007"
    return replace(record, notes=(note, *record.notes)) if end == len(data) else None


def _read(
    data: bytes, how: ReadingOptions, layout: fmr.Layout, *, certification: int
) -> tuple[TemplateRecord, int]:
    """Return what a record holds and where it ends, `certification` bytes before the device."""
    reader, notes = fmr.begin(data, VERSION, AMENDED), list[str]()
    name = AMENDED_CODEC.name if data[4:8] == AMENDED else CODEC.name
    declared = reader.number(4)
    fields = product_fields(reader, certification)
    count = reader.number()
    reader.number()  # reserved
    how.limits.check_views(count)
    views = [replace(_read_view(reader, layout, how, notes), fields=fields) for _ in range(count)]
    fmr.check_end(data, reader.at, declared, notes)
    return TemplateRecord(name, tuple(views), tuple(notes)), reader.at


def encode(record: TemplateRecord, version: bytes = VERSION) -> Encoded:
    """Return a record as bytes, and what they could not hold."""
    notes: list[str] = []
    views = fmr.numbered(record)
    body = b"".join(_write_view(view, notes) for view in views)
    head = fmr.MAGIC + version + (HEADER_BYTES + len(body)).to_bytes(4, "big")
    head += bytes(7) + bytes([len(views), 0])  # owner, type, certification and device unknown
    return Encoded(head + body, tuple(notes))


def encode_amended(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of the amendment, and what they could not hold."""
    return encode(record, AMENDED)


def _read_view(
    reader: ByteReader, layout: fmr.Layout, how: ReadingOptions, notes: list[str]
) -> View:
    finger, number, impression = reader.number(), reader.number(), reader.number()
    quality = reader.number()
    reader.take(len(NO_QUALITY_ALGORITHM))
    frame = fmr.Frame(*(reader.number(2) for _ in range(4)))
    view = fmr.read_view(reader, frame, layout, how, notes)
    return replace(
        view,
        finger=finger,
        number=number,
        impression=impression,
        quality=quality if quality <= 100 else None,
    )


def _write_view(view: View, notes: list[str]) -> bytes:
    quality = UNKNOWN_QUALITY if view.quality is None else fmr.quality_of(view)
    head = bytes([view.finger & 0xFF, view.number, view.impression & 0xFF, quality])
    frame = frame_bytes(fmr.Frame.of(view.template))
    return head + NO_QUALITY_ALGORITHM + frame + fmr.write_view(view, LAYOUT, notes)


def _recognises(data: bytes) -> bool:
    return data.startswith(fmr.MAGIC + VERSION) and not is_iso_2011(data)


def _recognises_amended(data: bytes) -> bool:
    return data.startswith(fmr.MAGIC + AMENDED)


CODEC: Final = Codec(
    "ansi2009", "ANSI/INCITS 378-2009", (".ansi2009",), _recognises, decode, encode
)
AMENDED_CODEC: Final = Codec(
    "ansi2009am1",
    "ANSI/INCITS 378-2009/AM1",
    (".ansi2009am1",),
    _recognises_amended,
    decode,
    encode_amended,
)
