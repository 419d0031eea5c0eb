"""Finger minutiae records, ``FMR``, of ISO/IEC 19794-2:2005 and ANSI/INCITS 378-2004.

Records of all years begin with ``FMR`` and a version, are big-endian, count positions in whole
pixels from the top left, and keep a minutia in five or six bytes: kind and x (2 and 14 bits), y (14
bits), angle (one byte), quality (one byte, if six). Angles run counter-clockwise from +x in the
direction of ISO/IEC 19794-2, in 256 steps of a turn (ISO) or in 180 (ANSI).

The two formats of this module have one size and resolution for all views, 255 minutiae in a view,
and 0 for an unknown quality; ANSI's header is longer. ISO's compact formats for cards, which have
no header, and ANSI's records of more than 65,535 bytes are neither read nor written.
"""

from __future__ import annotations

import struct
from collections import Counter
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.base.binary_records import ByteReader
from fpmatch.base.plugins import FMR_SIGNATURE
from fpmatch.errors import TemplateError
from fpmatch.formats.record import (
    Codec,
    Encoded,
    ReadingOptions,
    TemplateRecord,
    View,
    check_minutiae,
    check_views,
    fit_minutiae,
    span,
    whole_steps,
)
from fpmatch.printable import count
from fpmatch.templates.minutiae import (
    CM_PER_INCH,
    Minutiae,
    MinutiaKind,
    Template,
    dpi_of_per_cm,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

COORDINATE_MASK: Final = 0x3FFF
KIND_SHIFT: Final = 14
_COLUMNS: Final = [("x", ">u2"), ("y", ">u2"), ("angle", "u1"), ("quality", "u1")]
MINUTIA: Final = {5: np.dtype(_COLUMNS[:3]), 6: np.dtype(_COLUMNS)}  # by its bytes
WITHOUT_EXTENDED: Final = "its views end without the length of extended data"
IN_ISO_STEPS: Final = "angles are beyond 179, so all are read in the steps of ISO, 256 to a turn"
ISO_STEPS: Final = 256
ANSI_STEPS: Final = 180
MISMATCH: Final = 0.01  # of horizontal and vertical resolution, attributed to rounding
MOST_MINUTIAE: Final = 255  # largest count in one byte
MOST_VIEWS: Final = 255
ANSI_HEADER_BYTES: Final = 26
VERSION: Final = b" 20\x00"
ANSI_VERSIONS: Final = (VERSION, b"020\x00")  # the second in early files only
Frame = tuple[int, int, int, int]
"""Width and height in pixels, horizontal and vertical pixels a centimetre; 0 is unknown."""


class Layout(NamedTuple):
    """Differences between the formats of the family.

    `name` is that of the format, `angle_steps` the steps of a turn. The older
    formats have one frame for all views, and 0 for an unknown quality; since 2009 each view has its
    own frame, and 254 or 255.
    """

    name: str
    angle_steps: int
    is_older: bool = True


ISO: Final = Layout("iso2005", ISO_STEPS)
ANSI: Final = Layout("ansi2004", ANSI_STEPS)


class RecordReader(ByteReader):
    """Read the record of one of the `versions` in `data`, with a note on each irregularity."""

    def __init__(
        self, data: bytes, options: ReadingOptions, layout: Layout, *versions: bytes
    ) -> None:
        if data[:4] != FMR_SIGNATURE or data[4:8] not in versions:
            raise TemplateError("does not begin as a record of the format does")
        super().__init__(data, TemplateError, 8)
        self.options = options
        self.layout = layout
        self.steps = layout.angle_steps
        self.beyond_steps = False  # whether an angle was
        self.has_extended = True
        self.notes: list[str] = []

    def record(self, declared: int, views: int, view: Callable[[], View]) -> TemplateRecord:
        """Return the record of as many `views`, the rest of `declared` bytes, each from `view`.

        Some writers leave out the length of extended data; some writers of ANSI records use the
        steps of ISO: if an angle is beyond the last step, all are read in those.
        """
        check_views(views)
        start = self.at

        def read_all(*notes: str) -> tuple[View, ...]:
            self.at, self.notes = start, [*notes]
            return tuple(view() for _ in range(views))

        without: tuple[str, ...] = ()
        try:
            all_views = read_all()
        except TemplateError:
            if declared != len(self.data):
                raise
            self.has_extended, without = False, (WITHOUT_EXTENDED,)
            all_views = read_all(*without)
            if self.at != declared:
                raise
        if self.beyond_steps:
            self.steps = ISO_STEPS
            all_views = read_all(IN_ISO_STEPS, *without)
        if declared != self.at:
            self.notes.append(f"the header declares {declared} bytes, the record has {self.at}")
        if self.data[self.at :].strip(b"\x00"):  # many writers pad with zeros
            self.notes.append(f"{count(self.left, 'byte')} after the record passed over")
        return TemplateRecord(self.layout.name, all_views, tuple(self.notes))

    def view(self, frame: Frame, *, size: int = 6, quality: int | None, **about: Any) -> View:
        """Read count, minutiae of `size` bytes and extended data of a view.

        `quality` is its quality byte, unknown over 100; `about` has its other fields.
        """
        if size not in MINUTIA:
            raise TemplateError(f"a minutia has {size} bytes, where 5 or 6 are expected")
        minutia_count = self.number()
        check_minutiae(minutia_count)
        rows = np.frombuffer(self.take(minutia_count * size), MINUTIA[size])
        minutiae, quality_known = self._minutiae(rows)
        extended = self._extended()
        width, height, per_cm_x, per_cm_y = frame
        size_known, dpi_known = min(width, height) > 0, min(per_cm_x, per_cm_y) > 0
        if dpi_known and abs(per_cm_x - per_cm_y) > max(1.0, MISMATCH * per_cm_x):
            raise TemplateError(
                f"horizontal and vertical resolution differ ({per_cm_x} and {per_cm_y} pixels a cm)"
            )
        dpi = dpi_of_per_cm(per_cm_x) if dpi_known else self.options.dpi
        if not size_known:
            width, height = self.options.size or span(minutiae.x, minutiae.y)
        return View(
            Template(minutiae, width, height, dpi, dpi_known=dpi_known),
            quality=quality if quality is not None and quality <= 100 else None,
            size_known=size_known,
            quality_known=quality_known,
            extended=extended,
            **about,
        )

    def _minutiae(self, rows: NDArray[np.void]) -> tuple[Minutiae, bool]:
        """Return the minutiae in the rows of a view, and whether their quality is known."""
        kind = (rows["x"] >> KIND_SHIFT).astype(np.uint8)
        reserved = kind > max(MinutiaKind)
        if reserved.any():
            odd = count(int(np.count_nonzero(reserved)), "minutia", "minutiae")
            self.notes.append(f"{odd} of a reserved kind read as other")
            kind[reserved] = MinutiaKind.OTHER
        self.beyond_steps |= bool((rows["angle"] >= self.steps).any())
        quality, known = np.full(len(rows), 100, np.uint8), False
        if "quality" in (rows.dtype.names or ()):
            lowest = 1 if self.layout.is_older else 0
            each_known = (rows["quality"] >= lowest) & (rows["quality"] <= 100)
            known = bool(each_known.any()) or not len(rows)
            if known:
                quality = np.where(each_known, rows["quality"], 0).astype(np.uint8)
        x, y = ((rows[name] & COORDINATE_MASK).astype(np.float32) for name in ("x", "y"))
        angle: Any = rows["angle"] * (2 * np.pi / self.steps)
        return Minutiae(x, y, angle, kind, quality), known

    def _extended(self) -> bytes:
        """Return the extended data, none if the file ends within them or has no length of them."""
        length = self.number(2) if self.has_extended else 0
        if length > self.left:
            self.notes.append(
                f"extended data cut short ({self.left} of {length} bytes) and passed over"
            )
            self.take(self.left)
            return b""
        return self.take(length)


def decode_iso(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in an ISO record, or raise TemplateError."""
    reader = RecordReader(data, options, ISO, VERSION)
    (declared,) = reader.numbers("I2x")
    return _decode_views(reader, declared)


def decode_ansi(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in an ANSI record, or raise TemplateError."""
    reader = RecordReader(data, options, ANSI, *ANSI_VERSIONS)
    (declared,) = reader.numbers("H6x")
    return _decode_views(reader, declared)


def _decode_views(reader: RecordReader, declared: int) -> TemplateRecord:
    """Read the rest of a record, of `declared` bytes in all, behind its product."""
    *frame, views = reader.numbers("4HBx")

    def view() -> View:
        finger, both, quality = reader.numbers("3B")
        return reader.view(tuple(frame), quality=quality, finger=finger, impression=both % 16)

    return reader.record(declared, views, view)


def encode(record: TemplateRecord, *, layout: Layout) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold; its product is unknown.

    The views of each finger are numbered from 0.
    """
    if len(record.views) > MOST_VIEWS:
        raise TemplateError(f"the format holds {MOST_VIEWS} prints at most")
    frames = {_frame(view.template) for view in record.views}
    if len(frames) != 1:
        raise TemplateError(
            "the format has one size and resolution for all prints of a file, and these differ"
        )
    notes: list[str] = []
    numbers = Counter[int]()
    body = struct.pack(">4HBx", *frames.pop(), len(record.views))
    for view in record.views:
        body += _encode_view(view, numbers[view.finger], layout, record.format, notes)
        numbers[view.finger] += 1
    size, product = (4, bytes(2)) if layout is ISO else (2, bytes(6))
    head = FMR_SIGNATURE + VERSION
    length = _check_fits(len(head) + size + len(product) + len(body), 8 * size, "a length")
    return Encoded(head + length.to_bytes(size, "big") + product + body, tuple(notes))


def _frame(template: Template) -> Frame:
    """Return the frame of a template; raises TemplateError if the format cannot hold it."""
    step = round(template.dpi / CM_PER_INCH)  # 500 dpi are 197
    for side in (template.width, template.height):
        _check_fits(side - 1, 14, "a position")
    return template.width, template.height, step, step


def _check_fits(value: int, bits: int, what: str) -> int:
    """Return `value`, or raise TemplateError unless `bits` bits can hold it."""
    if value >= 2**bits:
        raise TemplateError(f"the format cannot hold {what} of {value}: {2**bits - 1} at most")
    return value


def _encode_view(view: View, number: int, layout: Layout, source: str, notes: list[str]) -> bytes:
    """Return a view of a record of format `source` as bytes; losses go to `notes`.

    `number` counts the views of its finger, from 0.
    """
    template, impression = view.template, view.impression
    if not 0 <= impression < 16:
        notes.append(f"impression type {impression} written as 0, live plain")
        impression = 0
    quality = view.quality
    if quality is None:  # the mean of its minutiae
        quality = round(float(template.minutiae.quality.mean())) if len(template) else 0
    quality = min(100, max(0, quality))
    minutiae = fit_minutiae(template, MOST_MINUTIAE, notes)
    rows = np.zeros(len(minutiae), MINUTIA[6])
    sides = np.array([template.width, template.height])
    x, y = np.clip(np.rint(minutiae.xy.astype(np.float64)), 0, sides - 1).astype(np.int64).T
    rows["x"] = x | (minutiae.kind.astype(np.int64) << KIND_SHIFT)
    rows["y"] = y
    rows["angle"] = whole_steps(minutiae.angle, layout.angle_steps)
    if view.quality_known:
        rows["quality"] = np.maximum(minutiae.quality, 1)
    extended = view.extended
    if extended and source != layout.name:
        notes.append(f"extended data of {source} dropped")
        extended = b""
    elif extended and len(minutiae) < len(template.minutiae):
        notes.append("extended data dropped, as they count the minutiae that there were")
        extended = b""
    _check_fits(len(extended), 16, "extended data")
    head = bytes([view.finger & 0xFF, min(number, 15) << 4 | impression, quality, len(rows)])
    return head + rows.tobytes() + len(extended).to_bytes(2, "big") + extended


def _recognises(versions: tuple[bytes, ...], is_ansi: bool, data: bytes) -> bool:
    """Distinguish ANSI from ISO records, which begin alike, by the length.

    ISO's has four bytes, ANSI's two, and is 26 at least.
    """
    known = data[:4] == FMR_SIGNATURE and data[4:8] in versions
    return known and (int.from_bytes(data[8:10], "big") >= ANSI_HEADER_BYTES) is is_ansi


ISO_CODEC: Final = Codec(
    ISO.name,
    "ISO/IEC 19794-2:2005",
    (".iso", ".ist", ".fmr"),
    partial(_recognises, (VERSION,), False),
    decode_iso,
    partial(encode, layout=ISO),
)
ANSI_CODEC: Final = Codec(
    ANSI.name,
    "ANSI/INCITS 378-2004",
    (".ansi", ".ansi2004"),
    partial(_recognises, ANSI_VERSIONS, True),
    decode_ansi,
    partial(encode, layout=ANSI),
)
