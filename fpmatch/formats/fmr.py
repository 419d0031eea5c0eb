"""Finger minutiae records of ISO/IEC 19794-2:2005 and ANSI/INCITS 378-2004, and their family.

All records begin with ``FMR`` and a version, are big-endian, count positions in whole pixels from
the top left, and keep a minutia in five or six bytes: kind and x (2 and 14 bits), y (14 bits),
angle (one byte), quality (one byte, if six). Angles run counter-clockwise from +x in the direction
of ISO/IEC 19794-2, in 256 steps of a turn (ISO) or in 180 (ANSI).

The two formats here have one size and resolution for all views, 255 minutiae in a view, and 0 for
an unknown quality; ANSI's header is longer. ISO's compact formats for cards, which have no header,
are not read.
"""

from __future__ import annotations

import base64
import binascii
import re
import struct
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.base.binary_records import ByteReader
from fpmatch.base.plugins import FMR_SIGNATURE
from fpmatch.errors import TemplateError
from fpmatch.formats.codec import (
    Codec,
    check_fits,
    fit_minutiae,
    side,
    whole_pixels,
    whole_steps,
)
from fpmatch.formats.record import Encoded, ExtendedData, ReadingOptions, TemplateRecord, View
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

MOST_MINUTIAE: Final = 255  # largest count in one byte
MOST_VIEWS: Final = 255
COORDINATE_MASK: Final = 0x3FFF
KIND_SHIFT: Final = 14
_COLUMNS: Final = [("x", ">u2"), ("y", ">u2"), ("angle", "u1"), ("quality", "u1")]
MINUTIA: Final = {5: np.dtype(_COLUMNS[:3]), 6: np.dtype(_COLUMNS)}  # by its bytes
WITHOUT_EXTENDED: Final = "its views end without the length of extended data"
IN_ISO_STEPS: Final = "angles are beyond 179, so all are read in the steps of ISO, 256 to a turn"
ISO_STEPS: Final = 256
ANSI_STEPS: Final = 180
_IN_BASE64: Final = b"Rk1SA"  # the beginning, as the next byte is a space or a digit
_URL_SAFE: Final = bytes.maketrans(b"-_", b"+/")
_IN_HEX: Final = re.compile(rb"(?:0x|\\x)?(?P<magic>464d5200)", re.IGNORECASE)
MISMATCH: Final = 0.01  # of horizontal and vertical resolution, attributed to rounding
ISO_HEADER_BYTES: Final = 24
ANSI_HEADER_BYTES: Final = 26
VIEW_BYTES: Final = 4  # before the minutiae
VERSION: Final = b" 20\x00"
NO_ALGORITHM: Final = bytes(4)  # of quality
UNKNOWN_QUALITY: Final = 254
ANSI_VERSIONS: Final = (VERSION, b"020\x00")  # the second in early files only
LONG_LENGTH: Final = 2**16  # from which on ANSI's length takes six bytes


class AngleError(TemplateError):
    """An angle is beyond the last step of the format."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Differences between the formats of the family.

    `name` is the format to which extended data belong, `angle_steps` the steps of a turn. The older
    formats have one frame for all views, and 0 for an unknown quality; since 2009 each view has its
    own frame, and 254 or 255. A record's length, whose bytes may be six if they are two, and the
    bytes of its product follow the version.
    """

    name: str
    angle_steps: int
    length_bytes: int = 4
    product_bytes: int = 0
    is_older: bool = True


ISO: Final = Layout("iso2005", ISO_STEPS, product_bytes=2)
ANSI: Final = Layout("ansi2004", ANSI_STEPS, length_bytes=2, product_bytes=6)


def per_cm(dpi: float) -> int:
    """Return a resolution in whole pixels per centimetre: 500 dpi are 197."""
    return round(dpi / CM_PER_INCH)


def dpi_of(per_cm_x: int, per_cm_y: int) -> float:
    """Return the dpi of a resolution in whole pixels per centimetre, both positive."""
    if abs(per_cm_x - per_cm_y) > max(1.0, MISMATCH * per_cm_x):
        raise TemplateError(
            f"horizontal and vertical resolution differ ({per_cm_x} and {per_cm_y} pixels a cm)"
        )
    return dpi_of_per_cm(per_cm_x)


class Frame(NamedTuple):
    """Image size in pixels and resolution in pixels per centimetre; 0 is unknown."""

    width: int
    height: int
    per_cm_x: int
    per_cm_y: int

    @classmethod
    def of(cls, template: Template, bits: int = 16) -> Frame:
        """Return the frame of a template; raises TemplateError if `bits` bits cannot hold it."""
        step = check_fits(per_cm(template.dpi), 16, "a resolution")
        for length in (template.width, template.height):
            check_fits(length - 1, 14, "a position")  # in all formats of the family
        width = check_fits(template.width, bits, "a width")
        return cls(width, check_fits(template.height, bits, "a height"), step, step)

    @classmethod
    def shared(cls, record: TemplateRecord) -> Frame:
        """Return the frame that all views share; raises TemplateError if they differ."""
        frames = {cls.of(view.template) for view in record.views}
        if len(frames) != 1:
            raise TemplateError(
                "the format has one size and resolution for all prints of a file, and these differ"
            )
        return frames.pop()

    def to_bytes(self) -> bytes:
        """Return width, height, horizontal and vertical resolution in two bytes each."""
        return struct.pack(">4H", *self)


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
        self.has_extended = True
        self.notes: list[str] = []

    def record(
        self, name: str, declared: int, views: int, view: Callable[[], View]
    ) -> TemplateRecord:
        """Return the record of as many `views`, the rest of `declared` bytes, each from `view`.

        Some writers of ANSI records use the steps of ISO: if an angle is beyond the last step, all
        are read in those.
        """
        self.options.limits.check_views(views)
        start, notes = self.at, [*self.notes]
        try:
            all_views = self._views(declared, views, view)
        except AngleError:
            self.at, self.notes = start, notes
            self.steps, self.has_extended = ISO_STEPS, True
            all_views = self._views(declared, views, view)
            self.notes.insert(0, IN_ISO_STEPS)
        if declared != self.at:
            self.notes.append(f"the header declares {declared} bytes, the record has {self.at}")
        if self.data[self.at :].strip(b"\x00"):  # many writers pad with zeros
            self.notes.append(f"{count(self.left, 'byte')} after the record passed over")
        return TemplateRecord(name, all_views, tuple(self.notes))

    def _views(self, declared: int, views: int, view: Callable[[], View]) -> tuple[View, ...]:
        """Return all views, also those that end without the length of extended data."""
        start = self.at
        try:
            return tuple(view() for _ in range(views))
        except AngleError:
            raise
        except TemplateError:
            if declared != len(self.data):
                raise
            self.at, self.has_extended, self.notes = start, False, [WITHOUT_EXTENDED]
            all_views = tuple(view() for _ in range(views))
            if self.at != declared:
                raise
            return all_views

    def view(self, frame: Frame, *, size: int = 6, quality: int | None, **about: Any) -> View:
        """Read count, minutiae of `size` bytes and extended data of a view.

        `quality` is its quality byte, unknown over 100; `about` has its other fields.
        """
        if size not in MINUTIA:
            raise TemplateError(f"a minutia has {size} bytes, where 5 or 6 are expected")
        minutia_count = self.number()
        self.options.limits.check_minutiae(minutia_count)
        self.options.limits.check_size(frame.width, frame.height)
        rows = np.frombuffer(self.take(minutia_count * size), MINUTIA[size])
        minutiae, quality_known = self._minutiae(rows)
        extended = self._extended()
        dpi_known = frame.per_cm_x > 0 and frame.per_cm_y > 0
        size_known = frame.width > 0 and frame.height > 0
        dpi = dpi_of(frame.per_cm_x, frame.per_cm_y) if dpi_known else self.options.assumed_dpi
        width, height = frame[:2] if size_known else self.options.size or span(minutiae)
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
        if (rows["angle"] >= self.steps).any():
            raise AngleError(f"an angle is beyond {self.steps - 1}, the last of the format")
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

    def _extended(self) -> ExtendedData | None:
        """Return the extended data, None if the file ends within them or has no length of them."""
        if not self.has_extended:
            return None
        length = self.number(2)
        if length > self.left:
            self.notes.append(
                f"extended data cut short ({self.left} of {length} bytes) and passed over"
            )
            self.take(self.left)
            return None
        return ExtendedData(self.layout.name, self.take(length)) if length else None


def fills(data: bytes, header: int, view: int) -> bool:
    """Return whether views of minutiae fill `data`, perhaps but for zeros at the end.

    Before them is a `header` of as many bytes, the number of views last but one; a `view` has as
    many bytes before its minutiae of six, their number last.
    """
    at, views = header, data[header - 2] if header <= len(data) else 0
    for _ in range(views):
        if at + view > len(data):
            return False
        at += view + 6 * data[at + view - 1]
        at += 2 + int.from_bytes(data[at : at + 2], "big")  # extended data
    return views > 0 and at <= len(data) + 2 and not data[at:].strip(b"\x00")


def span(minutiae: Minutiae) -> tuple[int, int]:
    """Return width and height of the box from the origin that holds minutiae."""
    return side(minutiae.x), side(minutiae.y)


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


def of_text(data: bytes) -> bytes | None:
    """Return the record that a text encodes in base64 or hexadecimal; None for other data.

    Where the text is cut short, so is the record. Raises TemplateError for a damaged text.
    """
    digits = re.sub(rb"\s+", b"", data.strip(b"\xef\xbb\xbf \t\r\n\"'")).rstrip(b"=")
    try:
        if digits.startswith(_IN_BASE64):
            digits = digits[: len(digits) - (len(digits) % 4 == 1)]
            digits = digits.translate(_URL_SAFE) + b"=" * (-len(digits) % 4)
            return base64.b64decode(digits, validate=True)
        if hexadecimal := _IN_HEX.match(digits):
            digits = digits[hexadecimal.start("magic") :]
            return binascii.unhexlify(digits[: len(digits) // 2 * 2])
    except binascii.Error as error:
        raise TemplateError(f"damaged text of a finger minutiae record ({error})") from error
    return None


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
    reader: RecordReader, declared: int, fields: tuple[tuple[str, str], ...], name: str = ""
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

    return reader.record(name or reader.layout.name, declared, views, view)


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
