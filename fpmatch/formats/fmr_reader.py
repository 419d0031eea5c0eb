"""Read records of minutiae, ``FMR``: what ISO/IEC 19794-2 and ANSI/INCITS 378 of all years share.

All records begin with ``FMR`` and a version, are big-endian, count positions in whole pixels from
the top left, and keep a minutia in five or six bytes: kind and x (2 and 14 bits), y (14 bits),
angle (one byte), quality (one byte, if six). Angles run counter-clockwise from +x in the direction
of ISO/IEC 19794-2, in 256 steps of a turn (ISO) or in 180 (ANSI).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.base.binary_records import ByteReader
from fpmatch.base.plugins import FMR_SIGNATURE
from fpmatch.errors import TemplateError
from fpmatch.formats.codec import check_fits, side
from fpmatch.formats.record import ExtendedData, ReadingOptions, TemplateRecord, View
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
