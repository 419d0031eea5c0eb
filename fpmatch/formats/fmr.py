"""Views of finger minutiae records (ISO/IEC 19794-2, ANSI/INCITS 378).

All records begin with ``FMR`` and a version, are big-endian, count positions in whole pixels from
the top left, and keep a minutia in five or six bytes: kind and x (2 and 14 bits), y (14 bits),
angle (one byte), quality (one byte, if six). Angles run counter-clockwise from +x in the direction
of ISO/IEC 19794-2, in 256 steps of a turn (ISO) or in 180 (ANSI).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.base.binary_records import ByteReader
from fpmatch.errors import TemplateError
from fpmatch.formats.codec import (
    check_fits,
    fit_minutiae,
    side,
    whole_pixels,
    whole_steps,
)
from fpmatch.formats.fmr_header import MAGIC, dpi_of
from fpmatch.formats.record import ExtendedData, TemplateRecord, View
from fpmatch.printable import count
from fpmatch.templates.minutiae import Minutiae, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.formats.fmr_header import Frame
    from fpmatch.formats.record import ReadingOptions

MOST_MINUTIAE: Final = 255  # largest count in one byte
MOST_VIEWS: Final = 255
COORDINATE_MASK: Final = 0x3FFF
KIND_SHIFT: Final = 14
_COLUMNS: Final = [("x", ">u2"), ("y", ">u2"), ("angle", "u1"), ("quality", "u1")]
MINUTIA: Final = {5: np.dtype(_COLUMNS[:3]), 6: np.dtype(_COLUMNS)}  # by its bytes
EXTENDED_HEADER: Final = 4  # bytes of type and length before a block of extended data
EXTENDED_KINDS: Final = {1: "ridge counts", 2: "cores and deltas", 3: "zonal quality"}
WITHOUT_EXTENDED: Final = "its views end without the length of extended data"
ISO_STEPS: Final = 256
ANSI_STEPS: Final = 180


class AngleError(TemplateError):
    """An angle is beyond the last step of the format."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Differences between the formats of the family in the encoding of a minutia.

    `name` is the format to which extended data belong, `angle_steps` the steps of a turn. An
    unknown quality is stored as 0 if `zero_is_unknown` (in the older formats), else as 254 or 255.
    """

    name: str
    angle_steps: int
    zero_is_unknown: bool


class RecordReader(ByteReader):
    """Read the record of one of the `versions` in `data`, with a note on each irregularity."""

    def __init__(
        self, data: bytes, options: ReadingOptions, layout: Layout, *versions: bytes
    ) -> None:
        if data[:4] != MAGIC or data[4:8] not in versions:
            raise TemplateError("does not begin as a record of the format does")
        super().__init__(data, TemplateError, 8)
        self.options = options
        self.layout = layout
        self.has_extended = True
        self.notes: list[str] = []

    def record(
        self, name: str, declared: int, views: int, view: Callable[[], View]
    ) -> TemplateRecord:
        """Return the record of as many `views`, the rest of `declared` bytes, each from `view`."""
        self.options.limits.check_views(views)
        start = self.at
        try:
            all_views = tuple(view() for _ in range(views))
        except AngleError:
            raise
        except TemplateError:
            self.at, self.has_extended, self.notes = start, False, [WITHOUT_EXTENDED]
            if declared != len(self.data):
                raise
            all_views = tuple(view() for _ in range(views))
            if self.at != declared:
                raise
        if declared != self.at:
            self.notes.append(f"the header declares {declared} bytes, the record has {self.at}")
        if self.data[self.at :].strip(b"\x00"):  # many writers pad with zeros
            self.notes.append(f"{count(self.left, 'byte')} after the record passed over")
        return TemplateRecord(name, all_views, tuple(self.notes))

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
        steps = self.layout.angle_steps
        if (rows["angle"] >= steps).any():
            raise AngleError(f"an angle is beyond {steps - 1}, the last of the format")
        quality, known = np.full(len(rows), 100, np.uint8), False
        if "quality" in (rows.dtype.names or ()):
            lowest = 1 if self.layout.zero_is_unknown else 0
            each_known = (rows["quality"] >= lowest) & (rows["quality"] <= 100)
            known = bool(each_known.any()) or not len(rows)
            if known:
                quality = np.where(each_known, rows["quality"], 0).astype(np.uint8)
        x, y = ((rows[name] & COORDINATE_MASK).astype(np.float32) for name in ("x", "y"))
        angle: Any = rows["angle"] * (2 * np.pi / steps)
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


def decode_ansi(read: Callable[[Layout], TemplateRecord], layout: Layout) -> TemplateRecord:
    """Return ``read(layout)``, with angles in ISO's 256 steps and a note if one is beyond 179.

    Some writers of ANSI records use the steps of ISO.
    """
    try:
        return read(layout)
    except AngleError:
        record = read(replace(layout, angle_steps=ISO_STEPS))
    note = "angles are beyond 179, so all are read in the steps of ISO, 256 to a turn"
    return replace(record, notes=(note, *record.notes))


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
        rows["quality"] = np.maximum(minutiae.quality, 1 if layout.zero_is_unknown else 0)
    elif size == 6:
        rows["quality"] = 0 if layout.zero_is_unknown else 254
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


def extended_kinds(extended: ExtendedData | None) -> list[str]:
    """Return descriptions of the blocks of extended data.

    The formats of 2005 leave open whether a block's length includes its own header; the
    interpretation under which the blocks fill the area is taken.
    """
    if extended is None or not extended.data:
        return []
    for uncounted in (0, EXTENDED_HEADER):
        codes = _block_codes(extended.data, uncounted)
        if codes is not None:
            return [EXTENDED_KINDS.get(code, f"maker's own 0x{code:04x}") for code in codes]
    return ["blocks that do not fill their area"]


def _block_codes(data: bytes, uncounted: int) -> list[int] | None:
    """Return the types of blocks that fill `data`, None if they do not.

    The length of a block leaves out `uncounted` bytes of its header.
    """
    codes, at = [], 0
    while at + EXTENDED_HEADER <= len(data):
        codes.append(int.from_bytes(data[at : at + 2], "big"))
        length = int.from_bytes(data[at + 2 : at + 4], "big") + uncounted
        if length < EXTENDED_HEADER:
            return None
        at += length
    return codes if at == len(data) else None
