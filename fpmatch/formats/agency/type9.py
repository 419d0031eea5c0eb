"""Minutiae in records of type 9 of ANSI/NIST-ITL files (AN2, EFT, EBTS). Only read.

A record of type 9 may hold minutiae in several blocks of fields; the first of these is read:

- 9.126 to 9.150, ANSI/INCITS 378 ("M1"): pixels from the top left, units of two degrees;
- 9.300 to 9.399, the extended feature set: 0.01 mm from the top left of a region, degrees;
- 9.013 to 9.030, FBI IAFIS: 0.01 mm from the top left, degrees;
- 9.005 to 9.012, the standard block: 0.01 mm from the bottom left, degrees in the direction
  opposite to that of ISO/IEC 19794-2.

Size and resolution come from the block, or the image record of the same number, or, the resolution
only, the first record. Ridge counts, cores and deltas are ignored.
"""

from __future__ import annotations

from collections.abc import Callable  # noqa: TC003  (the type of a field of a named tuple)
from functools import partial
from math import isnan, nan
from typing import Any, Final, NamedTuple

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.agency import an2
from fpmatch.formats.codec import LARGEST
from fpmatch.formats.fmr import span
from fpmatch.formats.record import ReadingOptions, TemplateRecord, View
from fpmatch.image.io.resolution import dpi_in_units
from fpmatch.printable import count
from fpmatch.templates.minutiae import Minutiae, MinutiaKind, Template

MINUTIAE_TYPE: Final = 9
IMAGE_FRAME, M1_FRAME = 6, 128  # the first of the fields of width, height, unit and resolution
REGION: Final = 300  # of the extended feature set: width, height and offsets, then its polygon
UNITS_PER_INCH: Final = 2540  # of 0.01 mm
WORST_QUALITY: Final = 63  # of the scale on which 2 is best, 1 unknown, and 0 set by hand
BEST_QUALITY: Final = 2
KINDS: Final = {
    **dict.fromkeys((b"A", b"E", b"1"), MinutiaKind.ENDING),
    **dict.fromkeys((b"B", b"2"), MinutiaKind.BIFURCATION),
}


class _Row(NamedTuple):
    """A minutia: position in the unit of its block, ISO angle in degrees, kind, quality or NaN."""

    x: float
    y: float
    degrees: float
    kind: int
    quality: float = nan


class _Block(NamedTuple):
    """A block of fields: its name, the field of the finger, how the items of a minutia are read."""

    name: str
    finger: int
    row: Callable[[list[bytes]], _Row]
    y_up: bool = False
    pixels: bool = False


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in the records of type 9, or raise TemplateError."""
    first, *others = an2.read_records(data, TemplateError)
    images = {r.idc: r for r in reversed(others) if r.type in an2.PRINT_TYPES}
    views, notes = list[View](), list[str]()
    for record in others:
        if record.type != MINUTIAE_TYPE:
            continue
        fields = record.fields()
        number = next((number for number in _BLOCKS if number in fields), None)
        if number is None:
            notes.append(f"a record of type 9 (IDC {record.idc}) without minutiae passed over")
            continue
        size, dpi = _frame(images.get(record.idc))
        if _BLOCKS[number].pixels:
            size, dpi = _field_frame(fields, M1_FRAME)
        frame = size, dpi or an2.native_dpi(first)
        views.append(_view(fields, number, frame, options, notes))
        options.limits.check_views(len(views))
    if not views:
        raise TemplateError("no minutiae in the file (no record of type 9 that has some)")
    return TemplateRecord("an2", tuple(views), tuple(notes))


def _view(
    fields: dict[int, bytes],
    number: int,
    frame: tuple[tuple[int, int] | None, float | None],
    options: ReadingOptions,
    notes: list[str],
) -> View:
    """Return the minutiae in the block of a field, in a frame whose parts may be unknown."""
    block, (known_size, known_dpi) = _BLOCKS[number], frame
    dpi = known_dpi or options.assumed_dpi
    scale = 1.0 if block.pixels else dpi / UNITS_PER_INCH
    options.limits.check_minutiae(fields[number].count(an2.RS) + 1)
    try:
        all_rows = [block.row(items) for items in an2.table(fields[number])]
    except (IndexError, ValueError) as error:
        raise TemplateError(f"field 9.{number:03d} is malformed") from error
    rows = [row for row in all_rows if not isnan(row.degrees)]
    if undirected := len(all_rows) - len(rows):
        notes.append(f"{count(undirected, 'minutia', 'minutiae')} without a direction passed over")
    table: Any = np.array(rows, np.float64).reshape(-1, len(_Row._fields))
    x, y, degrees, kind, quality = table.T
    if REGION in fields and block.name == EFS:
        left, top, right, bottom = _region(fields)
        x, y = x + left, y + top
        spanned = round(right * scale), round(bottom * scale)
        known_size = known_size or (spanned if min(spanned) > 0 else None)
    x, y, size = x * scale, y * scale, known_size or options.size
    if block.y_up:
        y = (size[1] if size else np.ceil(y.max(initial=1.0))) - y
    known = ~np.isnan(quality)
    grades = np.where(known, quality, 100.0)
    minutiae = Minutiae(x, y, np.radians(degrees), kind, grades)
    width, height = size or span(minutiae)
    options.limits.check_size(width, height)
    return View(
        Template(minutiae, width, height, dpi, dpi_known=known_dpi is not None),
        finger=_code(fields, block.finger),
        impression=_code(fields, 3),
        size_known=known_size is not None,
        quality_known=bool(known.any()) or not rows,
        fields=(("minutiae of", block.name),),
    )


def _region(fields: dict[int, bytes]) -> tuple[float, float, float, float]:
    """Return the edges of the region of an extended feature set: left, top, right, bottom."""
    items = [*an2.table(fields[REGION])[0], *[b""] * 4][:4]
    try:
        width, height, left, top = (_number(item) if item.strip() else 0.0 for item in items)
    except ValueError as error:
        raise TemplateError(f"field 9.{REGION} is malformed") from error
    return left, top, left + width if width else 0.0, top + height if height else 0.0


def _m1(items: list[bytes]) -> _Row:
    x, y, angle, quality = (_number(items[k]) for k in (1, 2, 3, 5))
    known = min(100.0, quality) if quality > 0 else nan
    return _Row(x, y, angle * 2.0, _kind(items, 4), known)


def _efs(items: list[bytes]) -> _Row:
    degrees = _number(items[2]) if len(items) > 2 and items[2].strip() else nan
    return _Row(_number(items[0]), _number(items[1]), degrees, _kind(items, 3))


def _packed(items: list[bytes], turn: float) -> _Row:
    """Return the minutia of items XXXXYYYYTTT, quality and kind, rotated by `turn` degrees."""
    x, y, degrees = (_number(items[1][part]) for part in (slice(4), slice(4, 8), slice(8, 11)))
    quality = nan
    if len(items) > 2 and items[2].strip() and (grade := _number(items[2])) >= BEST_QUALITY:
        quality = 100 * max(0.0, WORST_QUALITY - grade) / (WORST_QUALITY - BEST_QUALITY)
    return _Row(x, y, degrees + turn, _kind(items, 3), quality)


EFS: Final = "extended feature set"
_BLOCKS: Final = {  # by the field of the minutiae; the first that a record has is read
    137: _Block("ANSI/INCITS 378 block", 134, _m1, pixels=True),
    331: _Block(EFS, 302, _efs),
    23: _Block("FBI IAFIS block", 14, partial(_packed, turn=0.0)),
    12: _Block("standard block", 6, partial(_packed, turn=180.0), y_up=True),
}


def _frame(image: an2.Record | None) -> tuple[tuple[int, int] | None, float | None]:
    """Return size and resolution in an image record, None where they are unknown."""
    if image is None:
        return None, None
    if image.type != an2.GREY_FINGER:
        return _field_frame(image.fields(), IMAGE_FRAME)
    width, height = (int.from_bytes(image.data[k : k + 2], "big") for k in (13, 15))
    return (width, height) if width and height else None, None


def _field_frame(
    fields: dict[int, bytes], first: int
) -> tuple[tuple[int, int] | None, float | None]:
    width, height, unit, value = (_code(fields, first + k) for k in range(4))
    return (width, height) if width and height else None, dpi_in_units(unit, value)


def _kind(items: list[bytes], at: int) -> int:
    return KINDS.get(items[at] if at < len(items) else b"", MinutiaKind.OTHER)


def _number(value: bytes) -> float:
    """Return a number written as text, or raise ValueError."""
    number = float(value)
    if not abs(number) <= LARGEST:
        raise ValueError("not finite")
    return number


def _code(fields: dict[int, bytes], number: int) -> int:
    """Return the whole number in the first item of a field, 0 if there is none."""
    first = an2.table(fields.get(number, b""))[0][0].strip()
    return int(first) if first.isdigit() and len(first) < 7 else 0


def _recognises(data: bytes) -> bool:
    return MINUTIAE_TYPE in an2.types_of(data)


CODECS: Final = {"an2": (_recognises, decode, None)}
