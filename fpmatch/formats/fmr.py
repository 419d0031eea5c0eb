"""Views of finger minutiae records (ISO/IEC 19794-2, ANSI/INCITS 378).

All records begin with ``FMR`` and a version, are big-endian, count positions in whole pixels from
the top left, and keep a minutia in five or six bytes: kind and x (2 and 14 bits), y (14 bits),
angle (one byte), quality (one byte, if six). Angles run counter-clockwise from +x in the direction
of ISO/IEC 19794-2, in 256 steps of a turn (ISO) or in 180 (ANSI).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import (
    check_fits,
    fit_minutiae,
    minutiae_from_columns,
    whole_pixels,
    whole_steps,
)
from fpmatch.formats.fmr_header import dpi_of
from fpmatch.formats.record import ExtendedData, View
from fpmatch.minutiae import STANDARD_DPI, Minutiae, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.formats.fmr_header import ByteReader, Frame
    from fpmatch.formats.record import ReadingOptions, TemplateRecord

MOST_MINUTIAE: Final = 255  # largest count in one byte
MOST_VIEWS: Final = 255
COORDINATE_MASK: Final = 0x3FFF
KIND_SHIFT: Final = 14
SIX_BYTES: Final = np.dtype([("x", ">u2"), ("y", ">u2"), ("angle", "u1"), ("quality", "u1")])
FIVE_BYTES: Final = np.dtype([("x", ">u2"), ("y", ">u2"), ("angle", "u1")])
EXTENDED_HEADER: Final = 4  # bytes of type and length before a block of extended data
EXTENDED_KINDS: Final = {1: "ridge counts", 2: "cores and deltas", 3: "zonal quality"}
ISO_STEPS: Final = 256
ANSI_STEPS: Final = 180


class AngleError(TemplateError):
    """An angle is beyond the last step of the format."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Differences between the formats of the family in the encoding of a minutia.

    Parameters
    ----------
    name : str
        The format to which extended data belong.
    angle_steps : int
        Steps of a turn.
    zero_is_unknown : bool
        Whether an unknown quality is stored as 0 (the older formats) or as 254 or 255.
    """

    name: str
    angle_steps: int
    zero_is_unknown: bool

    def known(self, quality: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Return which quality bytes hold a quality."""
        known: NDArray[np.bool_] = quality <= 100
        return known & (quality > 0) if self.zero_is_unknown else known


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


def read_view(
    reader: ByteReader,
    frame: Frame,
    layout: Layout,
    options: ReadingOptions,
    notes: list[str],
    *,
    size: int = SIX_BYTES.itemsize,
) -> View:
    """Read the count, the minutiae and the extended data of one view.

    Parameters
    ----------
    reader : ByteReader
        Positioned at the count.
    frame : Frame
        Size and resolution in the header; 0 is unknown.
    layout : Layout
        Of the format.
    options : ReadingOptions
        Values for an unknown size or resolution, and the limits.
    notes : list of str
        Receives a line for each irregularity.
    size : int
        Bytes of a minutia, five or six.

    Returns
    -------
    View
        With template and extended data.

    Raises
    ------
    TemplateError
        If the bytes end too early, a limit is exceeded, or the resolutions of the axes differ.
    ResolutionError
        If the resolution is outside 100 to 4000 dpi.
    """
    if size not in (FIVE_BYTES.itemsize, SIX_BYTES.itemsize):
        raise TemplateError(f"a minutia has {size} bytes, where 5 or 6 are expected")
    count = reader.number()
    options.limits.check_minutiae(count)
    options.limits.check_size(frame.width, frame.height)
    dtype = SIX_BYTES if size == SIX_BYTES.itemsize else FIVE_BYTES
    rows = np.frombuffer(reader.take(count * size), dtype=dtype)
    minutiae, quality_known = _minutiae(rows, layout, notes)
    extended = _read_extended(reader, layout, notes)
    dpi_known = frame.per_cm_x > 0 and frame.per_cm_y > 0
    size_known = frame.width > 0 and frame.height > 0
    if dpi_known:
        dpi = dpi_of(frame.per_cm_x, frame.per_cm_y)
    else:
        dpi = STANDARD_DPI if options.dpi is None else options.dpi
    width, height = (frame.width, frame.height) if size_known else options.size or span(minutiae)
    return View(
        Template(minutiae, width, height, dpi),
        dpi_known=dpi_known,
        size_known=size_known,
        quality_known=quality_known,
        extended=extended,
    )


def span(minutiae: Minutiae) -> tuple[int, int]:
    """Return width and height of the box from the origin that holds minutiae, 1 at least."""
    if not len(minutiae):
        return 1, 1
    x, y = float(minutiae.x.max()), float(minutiae.y.max())
    return max(1, int(np.floor(x)) + 1), max(1, int(np.floor(y)) + 1)


def write_view(view: View, layout: Layout, notes: list[str], *, size: int = 6) -> bytes:
    """Return what `read_view` reads; raises TemplateError if the extended data are too long."""
    template = view.template
    minutiae = fit_minutiae(template, MOST_MINUTIAE, notes)
    rows = np.zeros(len(minutiae), SIX_BYTES if size == SIX_BYTES.itemsize else FIVE_BYTES)
    x = whole_pixels(minutiae.x, template.width)
    rows["x"] = x | (minutiae.kind.astype(np.int64) << KIND_SHIFT)
    rows["y"] = whole_pixels(minutiae.y, template.height)
    rows["angle"] = whole_steps(minutiae.angle, layout.angle_steps)
    if size == SIX_BYTES.itemsize:
        rows["quality"] = 0 if layout.zero_is_unknown else 254
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


def known_quality(quality: int) -> int | None:
    """Return the quality of a view, None for a byte over 100."""
    return quality if quality <= 100 else None


def quality_of(view: View) -> int:
    """Return the quality of a view, 0 to 100; if unknown, the mean of its minutiae."""
    if view.quality is not None:
        return min(100, max(0, view.quality))
    quality = view.template.minutiae.quality
    return round(float(quality.mean())) if quality.size else 0


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


def numbered(record: TemplateRecord, most: int = MOST_VIEWS) -> list[View]:
    """Return the views, renumbered from 0 for each finger; raises TemplateError if over `most`."""
    if len(record.views) > most:
        raise TemplateError(f"the format holds {most} prints at most")
    seen: dict[int, int] = {}
    counted = []
    for view in record.views:
        seen[view.finger] = seen.get(view.finger, -1) + 1
        counted.append(replace(view, number=seen[view.finger]))
    return counted


def _minutiae(rows: NDArray[np.void], layout: Layout, notes: list[str]) -> tuple[Minutiae, bool]:
    """Return the minutiae in the rows of a view, and whether their quality is known."""
    kind = (rows["x"] >> KIND_SHIFT).astype(np.int64)
    reserved = kind > max(MinutiaKind)
    if reserved.any():
        notes.append(f"{np.count_nonzero(reserved)} minutiae of a reserved kind read as other")
        kind[reserved] = MinutiaKind.OTHER
    if (rows["angle"] >= layout.angle_steps).any():
        raise AngleError(f"an angle is beyond {layout.angle_steps - 1}, the last of the format")
    quality, known = np.full(len(rows), 100, np.uint8), False
    if "quality" in (rows.dtype.names or ()):
        each_known = layout.known(rows["quality"])
        known = bool(each_known.any()) or not len(rows)
        if known:
            quality = np.where(each_known, rows["quality"], 0).astype(np.uint8)
    minutiae = minutiae_from_columns(
        (rows["x"] & COORDINATE_MASK).astype(np.float32),
        (rows["y"] & COORDINATE_MASK).astype(np.float32),
        rows["angle"] * (2 * np.pi / layout.angle_steps),
        kind,
        quality,
    )
    return minutiae, known


def _read_extended(reader: ByteReader, layout: Layout, notes: list[str]) -> ExtendedData | None:
    """Return the extended data, None if the file ends within them."""
    length = reader.number(2)
    if length > reader.left:
        notes.append(f"extended data cut short ({reader.left} of {length} bytes) and passed over")
        reader.take(reader.left)
        return None
    return ExtendedData(layout.name, reader.take(length)) if length else None


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
