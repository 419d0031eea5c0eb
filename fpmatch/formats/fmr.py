"""What the finger minutiae records of ISO/IEC 19794-2 and ANSI/INCITS 378 share.

All begin with ``FMR`` and a version, are big-endian, count positions in whole pixels from the top
left, and keep a minutia in five or six bytes: kind and x (2 and 14 bits), y (14 bits), angle (one
byte), quality (one byte, if six). Angles run counter-clockwise from +x in the direction of ISO/IEC
19794-2, in 256 steps of a turn (ISO) or in 180 (ANSI).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.byte_reader import ByteReader
from fpmatch.formats.columns import minutiae_of
from fpmatch.formats.fitting import check_fits, fit_minutiae, whole_pixels, whole_steps
from fpmatch.formats.record import ExtendedData, TemplateRecord, View
from fpmatch.formats.resolution import dpi_of, per_cm
from fpmatch.minutiae import STANDARD_DPI, Minutiae, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.formats.record import ReadingOptions

MAGIC: Final = b"FMR\x00"
MOST_MINUTIAE: Final = 255  # what the one byte of their number can count
MOST_VIEWS: Final = 255
COORDINATE_MASK: Final = 0x3FFF
KIND_SHIFT: Final = 14
SIX_BYTES: Final = np.dtype([("x", ">u2"), ("y", ">u2"), ("angle", "u1"), ("quality", "u1")])
FIVE_BYTES: Final = np.dtype([("x", ">u2"), ("y", ">u2"), ("angle", "u1")])
EXTENDED_HEADER: Final = 4  # bytes of type and length before a block of extended data
EXTENDED_KINDS: Final = {1: "ridge counts", 2: "cores and deltas", 3: "zonal quality"}


class AngleError(TemplateError):
    """An angle has more steps than a turn of the format."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Say in what the formats of the family differ where they write a minutia.

    Parameters
    ----------
    name : str
        The format, under which its extended data are kept.
    angle_steps : int
        Steps of a turn in which angles are counted.
    zero_is_unknown : bool
        Whether a quality of 0 means unknown (the older formats), or 254 and 255 do.
    """

    name: str
    angle_steps: int
    zero_is_unknown: bool

    @property
    def unknown_quality(self) -> int:
        """The byte for an unknown quality."""
        return 0 if self.zero_is_unknown else 254

    def known(self, quality: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Return which bytes of quality are known ones."""
        valid: NDArray[np.bool_] = quality <= 100
        return valid & (quality > 0) if self.zero_is_unknown else valid


ISO_STEPS: Final = 256
ANSI_STEPS: Final = 180


def decode_ansi(read: Callable[[Layout], TemplateRecord], layout: Layout) -> TemplateRecord:
    """Read a record whose angles should have 180 steps, but have 256 with some writers.

    Parameters
    ----------
    read : callable
        Reads the record by a layout.
    layout : Layout
        Of the format.

    Returns
    -------
    TemplateRecord
        By that layout; or, where an angle is beyond 179, with all angles in the steps of ISO,
        and a note.
    """
    try:
        return read(layout)
    except AngleError:
        record = read(replace(layout, angle_steps=ISO_STEPS))
    note = "angles are beyond 179, so all are read in the steps of ISO, 256 to a turn"
    return replace(record, notes=(note, *record.notes))


@dataclass(frozen=True, slots=True)
class Frame:
    """Hold size (pixels) and resolution (pixels a centimetre) as a header has them."""

    width: int
    height: int
    per_cm_x: int
    per_cm_y: int

    @classmethod
    def of(cls, template: Template, bits: int = 16) -> Frame:
        """Return the frame of a template whose sides `bits` bits shall hold."""
        step = check_fits(per_cm(template.dpi), 16, "a resolution")
        # positions have 14 bits, whatever the sides have
        for side in (template.width, template.height):
            check_fits(side - 1, 14, "a position")
        return cls(
            check_fits(template.width, bits, "a width"),
            check_fits(template.height, bits, "a height"),
            step,
            step,
        )


def begin(data: bytes, *versions: bytes) -> ByteReader:
    """Return a reader that stands after magic and version.

    Raises
    ------
    TemplateError
        If these are not what a record of one of `versions` begins with.
    """
    if data[:4] != MAGIC or data[4:8] not in versions:
        raise TemplateError("does not begin as a record of the format does")
    return ByteReader(data, 8)


def read_view(
    reader: ByteReader,
    frame: Frame,
    layout: Layout,
    how: ReadingOptions,
    notes: list[str],
    *,
    size: int = SIX_BYTES.itemsize,
) -> View:
    """Read the number of minutiae, the minutiae and the extended data of one view.

    Parameters
    ----------
    reader : ByteReader
        Where the number stands.
    frame : Frame
        Size and resolution of the print by the header.
    layout : Layout
        Of the format.
    how : ReadingOptions
        Values for what the header lacks, and the limits.
    notes : list of str
        Gets what is odd.
    size : int
        Bytes of a minutia, five or six.

    Returns
    -------
    View
        With template and extended data; the rest is for the caller to fill in.

    Raises
    ------
    TemplateError
        If the bytes end before the minutiae do, or a limit is passed.
    """
    if size not in (FIVE_BYTES.itemsize, SIX_BYTES.itemsize):
        raise TemplateError(f"a minutia has {size} bytes, where 5 or 6 are expected")
    count = reader.number()
    how.limits.check_minutiae(count)
    how.limits.check_size(frame.width, frame.height)
    dtype = SIX_BYTES if size == SIX_BYTES.itemsize else FIVE_BYTES
    rows = np.frombuffer(reader.take(count * size), dtype=dtype)
    minutiae, quality_known = _minutiae(rows, layout, notes)
    extended = _read_extended(reader, layout, notes)
    return replace(place(minutiae, frame, how), quality_known=quality_known, extended=extended)


def place(minutiae: Minutiae, frame: Frame, how: ReadingOptions) -> View:
    """Return minutiae in their frame; what it does not tell (0) comes from `how`, or is guessed.

    Raises
    ------
    TemplateError
        If the resolutions of the axes differ.
    ResolutionError
        If the resolution is outside 100 to 4000 dpi.
    """
    dpi_known = frame.per_cm_x > 0 and frame.per_cm_y > 0
    size_known = frame.width > 0 and frame.height > 0
    if dpi_known:
        dpi = dpi_of(frame.per_cm_x, frame.per_cm_y)
    else:
        dpi = STANDARD_DPI if how.dpi is None else how.dpi
    width, height = (frame.width, frame.height) if size_known else how.size or span(minutiae)
    template = Template(minutiae, width, height, dpi)
    return View(template, dpi_known=dpi_known, size_known=size_known)


def span(minutiae: Minutiae) -> tuple[int, int]:
    """Return width and height of the box from the origin that minutiae span, 1 at least."""
    if not len(minutiae):
        return 1, 1
    x, y = float(minutiae.x.max()), float(minutiae.y.max())
    return max(1, int(np.floor(x)) + 1), max(1, int(np.floor(y)) + 1)


def write_view(view: View, layout: Layout, notes: list[str], *, size: int = 6) -> bytes:
    """Return number, minutiae and extended data of one view as bytes, as `read_view` reads them.

    Raises
    ------
    TemplateError
        If the extended data are too long.
    """
    template = view.template
    minutiae = fit_minutiae(template, MOST_MINUTIAE, notes)
    rows = np.zeros(len(minutiae), SIX_BYTES if size == SIX_BYTES.itemsize else FIVE_BYTES)
    x = whole_pixels(minutiae.x, template.width)
    rows["x"] = x | (minutiae.kind.astype(np.int64) << KIND_SHIFT)
    rows["y"] = whole_pixels(minutiae.y, template.height)
    rows["angle"] = whole_steps(minutiae.angle, layout.angle_steps)
    if size == SIX_BYTES.itemsize:
        rows["quality"] = layout.unknown_quality
        if view.quality_known:
            rows["quality"] = np.maximum(minutiae.quality, 1 if layout.zero_is_unknown else 0)
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
    """Return the quality of a view, 0 to 100: where it is unknown, the mean of its minutiae."""
    if view.quality is not None:
        return min(100, max(0, view.quality))
    quality = view.template.minutiae.quality
    return round(float(quality.mean())) if quality.size else 0


def extended_kinds(extended: ExtendedData | None) -> list[str]:
    """Return the kinds of the blocks of extended data, as texts.

    The formats of 2005 leave open whether a block's length counts its own header; the reading
    under which the blocks fill the area is taken.
    """
    if extended is None or not extended.data:
        return []
    for counted in (0, EXTENDED_HEADER):
        codes = _block_codes(extended.data, counted)
        if codes is not None:
            return [EXTENDED_KINDS.get(code, f"maker's own 0x{code:04x}") for code in codes]
    return ["blocks that do not fill their area"]


def one_frame(record: TemplateRecord, bits: int = 16) -> Frame:
    """Return the one frame that all views of a record share.

    Raises
    ------
    TemplateError
        If they do not share one.
    """
    frames = {Frame.of(view.template, bits) for view in record.views}
    if len(frames) != 1:
        raise TemplateError(
            "the format has one size and resolution for all prints of a file, and these differ"
        )
    return frames.pop()


def numbered(record: TemplateRecord, most: int = MOST_VIEWS) -> list[View]:
    """Return the views of a record with their numbers counted anew, 0 for the first of each finger.

    Raises
    ------
    TemplateError
        If there are more than `most`.
    """
    if len(record.views) > most:
        raise TemplateError(f"the format holds {most} prints at most")
    seen: dict[int, int] = {}
    counted = []
    for view in record.views:
        seen[view.finger] = seen.get(view.finger, -1) + 1
        counted.append(replace(view, number=seen[view.finger]))
    return counted


def check_end(data: bytes, end: int, declared: int, notes: list[str]) -> None:
    """Note where the length in a header, the end of the record and that of the file differ."""
    if declared != end:
        notes.append(f"the header declares {declared} bytes, the record has {end}")
    if data[end:].strip(b"\x00"):  # many writers fill up with zeros
        notes.append(f"{len(data) - end} bytes after the record passed over")


def _minutiae(rows: NDArray[np.void], layout: Layout, notes: list[str]) -> tuple[Minutiae, bool]:
    """Return rows of the file as minutiae, and whether their quality is known."""
    kind = (rows["x"] >> KIND_SHIFT).astype(np.int64)
    strange = kind > max(MinutiaKind)
    if strange.any():
        notes.append(f"{np.count_nonzero(strange)} minutiae of a reserved kind read as other")
        kind[strange] = MinutiaKind.OTHER
    if (rows["angle"] >= layout.angle_steps).any():
        raise AngleError(f"an angle is beyond {layout.angle_steps - 1}, the last of the format")
    quality, known = np.full(len(rows), 100, np.uint8), False
    if "quality" in (rows.dtype.names or ()):
        valid = layout.known(rows["quality"])
        known = bool(valid.any()) or not len(rows)
        if known:
            quality = np.where(valid, rows["quality"], 0).astype(np.uint8)
    minutiae = minutiae_of(
        (rows["x"] & COORDINATE_MASK).astype(np.float32),
        (rows["y"] & COORDINATE_MASK).astype(np.float32),
        rows["angle"] * (2 * np.pi / layout.angle_steps),
        kind,
        quality,
    )
    return minutiae, known


def _read_extended(reader: ByteReader, layout: Layout, notes: list[str]) -> ExtendedData | None:
    """Return the extended data; of an area that the file cuts short, nothing."""
    length = reader.number(2)
    if length > reader.left:
        notes.append(f"extended data cut short ({reader.left} of {length} bytes) and passed over")
        reader.take(reader.left)
        return None
    return ExtendedData(layout.name, reader.take(length)) if length else None


def _block_codes(data: bytes, counted: int) -> list[int] | None:
    """Return the types of blocks that fill `data`, or None where they do not.

    `counted` is how many bytes of its header a block's length leaves out.
    """
    codes, at = [], 0
    while at + EXTENDED_HEADER <= len(data):
        codes.append(int.from_bytes(data[at : at + 2], "big"))
        length = int.from_bytes(data[at + 2 : at + 4], "big") + counted
        if length < EXTENDED_HEADER:
            return None
        at += length
    return codes if at == len(data) else None
