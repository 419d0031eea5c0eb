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

from typing import Final, NamedTuple

import numpy as np

from fpmatch.binary_records import RS, START, Record, contents, first_item, read_records, table
from fpmatch.errors import TemplateError
from fpmatch.formats.codec import LARGEST, Codec, minutiae_from_columns
from fpmatch.formats.fmr import span
from fpmatch.formats.fmr_header import CM_PER_INCH, ROUND_DPI
from fpmatch.formats.record import ReadingOptions, TemplateRecord, View
from fpmatch.templates.minutiae import MM_PER_INCH, MinutiaKind, Template

MINUTIAE_TYPE: Final = 9
TEXT_IMAGES: Final = frozenset({13, 14, 15})
BINARY_IMAGES: Final = frozenset(range(3, 7))
BINARY_HEADER_BYTES: Final = 18
IMAGE_FRAME_FIELDS: Final = (6, 7, 8, 9)  # width, height, unit of resolution, resolution
M1_FRAME_FIELDS: Final = (128, 129, 130, 131)
UNITS_PER_INCH: Final = 2540  # of 0.01 mm
WORST_QUALITY: Final = 63  # of the scale on which 2 is best, 1 unknown, and 0 set by hand
BEST_QUALITY: Final = 2
MINUTIAE_FIELDS: Final = (137, 331, 23, 12)  # of the blocks, in the order of the first lines
KINDS: Final = {
    **dict.fromkeys((b"A", b"E", b"1"), MinutiaKind.ENDING),
    **dict.fromkeys((b"B", b"2"), MinutiaKind.BIFURCATION),
}


class _Frame(NamedTuple):
    """Size in pixels and resolution in dpi of a print, None if unknown."""

    size: tuple[int, int] | None = None
    dpi: float | None = None


class _Row(NamedTuple):
    """A minutia: position in the unit of its block, ISO angle in degrees, kind, quality."""

    x: float
    y: float
    degrees: float
    kind: int
    quality: float | None


class _Block(NamedTuple):
    """The minutiae of one block of fields, and the field of the finger."""

    name: str
    rows: list[_Row]
    finger: int
    y_up: bool = False
    pixels: bool = False


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the prints in the records of type 9, or raise TemplateError."""
    first, *others = read_records(data, TemplateError)
    frames = _frames(others)
    native = _native_dpi(first)
    views, notes = [], list[str]()
    for record in others:
        if record.type != MINUTIAE_TYPE:
            continue
        fields = record.fields()
        block = _block(fields, options)
        if block is None:
            notes.append(f"a record of type 9 (IDC {record.idc}) without minutiae passed over")
            continue
        frame = frames.get(record.idc, _Frame())
        if block.pixels:
            frame = _field_frame(fields, *M1_FRAME_FIELDS)
        views.append(_view(block, frame, native, fields, options))
        options.limits.check_views(len(views))
    if not views:
        raise TemplateError("no minutiae in the file (no record of type 9 that has some)")
    return TemplateRecord(CODEC.name, tuple(views), tuple(notes))


def _view(
    block: _Block,
    frame: _Frame,
    native: float | None,
    fields: dict[int, bytes],
    options: ReadingOptions,
) -> View:
    """Return the view of a block of minutiae and a frame."""
    known_dpi = frame.dpi or native
    dpi = known_dpi or options.assumed_dpi
    scale = 1.0 if block.pixels else dpi / UNITS_PER_INCH
    x, y, degrees, kind, quality = zip(*block.rows, strict=True) if block.rows else [()] * 5
    px, py = np.array(x) * scale, np.array(y) * scale
    size = frame.size or options.size
    if block.y_up:
        py = (size[1] if size else np.ceil(py.max(initial=1.0))) - py
    grades = [100.0 if value is None else value for value in quality]
    minutiae = minutiae_from_columns(px, py, np.radians(np.array(degrees)), kind, grades)
    width, height = size or span(minutiae)
    options.limits.check_size(width, height)
    return View(
        Template(minutiae, width, height, dpi),
        finger=block.finger,
        impression=_code(fields, 3),
        dpi_known=known_dpi is not None,
        size_known=frame.size is not None,
        quality_known=any(value is not None for value in quality) or not quality,
        fields=(("minutiae of", block.name),),
    )


def _block(fields: dict[int, bytes], options: ReadingOptions) -> _Block | None:
    """Return the minutiae of a record of type 9, None if it has none."""
    number = next((number for number in MINUTIAE_FIELDS if number in fields), None)
    if number is None:
        return None
    options.limits.check_minutiae(fields[number].count(RS) + 1)
    rows = table(fields[number])
    try:
        match number:
            case 137:
                m1 = [_m1(row) for row in rows]
                return _Block("ANSI/INCITS 378 block", m1, _code(fields, 134), pixels=True)
            case 331:
                region = [_number(item) for item in table(fields.get(300, b""))[0] if item]
                left, top = region[2:4] if len(region) >= 4 else (0.0, 0.0)
                efs = [_efs(row, left, top) for row in rows]
                return _Block("extended feature set", efs, _code(fields, 302))
            case 23:
                iafis = [_packed(row, 0.0) for row in rows]
                return _Block("FBI IAFIS block", iafis, _code(fields, 14))
            case _:
                standard = [_packed(row, 180.0) for row in rows]
                return _Block("standard block", standard, _code(fields, 6), y_up=True)
    except (IndexError, ValueError) as error:
        raise TemplateError(f"field 9.{number:03d} is malformed") from error


def _m1(items: list[bytes]) -> _Row:
    x, y, angle, quality = (_number(items[k]) for k in (1, 2, 3, 5))
    known = min(100.0, quality) if quality > 0 else None
    return _Row(x, y, angle * 2.0, KINDS.get(items[4], MinutiaKind.OTHER), known)


def _efs(items: list[bytes], left: float, top: float) -> _Row:
    x, y, degrees = (_number(item) for item in items[:3])
    return _Row(x + left, y + top, degrees, KINDS.get(items[3], MinutiaKind.OTHER), None)


def _packed(items: list[bytes], turn: float) -> _Row:
    """Return the minutia of items XXXXYYYYTTT, quality and kind, rotated by `turn` degrees."""
    word = items[1]
    x, y, degrees = _number(word[:4]), _number(word[4:8]), _number(word[8:11])
    quality = None
    if len(items) > 2 and items[2].strip():
        grade = _number(items[2])
        if grade >= BEST_QUALITY:
            quality = 100 * max(0.0, WORST_QUALITY - grade) / (WORST_QUALITY - BEST_QUALITY)
    kind = KINDS.get(items[3], MinutiaKind.OTHER) if len(items) > 3 else MinutiaKind.OTHER
    return _Row(x, y, degrees + turn, kind, quality)


def _frames(records: list[Record]) -> dict[int, _Frame]:
    """Return the frames in the image records, by number."""
    frames: dict[int, _Frame] = {}
    for record in records:
        if record.type in TEXT_IMAGES:
            frames.setdefault(record.idc, _field_frame(record.fields(), *IMAGE_FRAME_FIELDS))
        elif record.type in BINARY_IMAGES and len(record.data) >= BINARY_HEADER_BYTES:
            width, height = (int.from_bytes(record.data[k : k + 2], "big") for k in (13, 15))
            frames.setdefault(record.idc, _Frame((width, height) if width and height else None))
    return frames


def _field_frame(fields: dict[int, bytes], *numbers: int) -> _Frame:
    """Return the frame in the fields of width, height, unit of resolution and resolution."""
    width, height, unit, value = (_code(fields, number) for number in numbers)
    dpi = None
    if value and unit == 1:
        dpi = float(value)
    elif value and unit == 2:  # per centimetre
        dpi = _rounded(value * CM_PER_INCH, CM_PER_INCH / 2)
    return _Frame((width, height) if width and height else None, dpi)


def _native_dpi(first: Record) -> float | None:
    """Return the scanning resolution in the first record, stored in pixels per millimetre."""
    try:
        dpi = _number(first.fields().get(11, b"")) * MM_PER_INCH
    except ValueError:
        return None
    return _rounded(dpi, 0.5) if dpi > 0 else None


def _rounded(dpi: float, slack: float) -> float:
    """Return the multiple of 100 within `slack` of a resolution, else the nearest whole number."""
    multiple = round(dpi / ROUND_DPI) * ROUND_DPI
    return float(multiple if abs(multiple - dpi) <= slack else round(dpi))


def _number(value: bytes) -> float:
    """Return a number written as text, or raise ValueError."""
    number = float(value)
    if not abs(number) <= LARGEST:
        raise ValueError("not finite")
    return number


def _code(fields: dict[int, bytes], number: int) -> int:
    """Return the whole number in the first item of a field, 0 if there is none."""
    first = first_item(fields.get(number, b"")).strip()
    return int(first) if first.isdigit() and len(first) < 7 else 0


def holds_image(data: bytes) -> bool:
    """Return whether data begin as a file with an image record."""
    return bool(_types(data) & (TEXT_IMAGES | BINARY_IMAGES))


def _recognises(data: bytes) -> bool:
    return MINUTIAE_TYPE in _types(data)


def _types(data: bytes) -> set[int]:
    """Return the types of the records that a file lists, none if it is not ANSI/NIST-ITL."""
    if not START.match(data):
        return set()
    try:
        return {kind for kind, _ in contents(data, TemplateError)}
    except TemplateError:
        return set()


CODEC: Final = Codec("an2", "ANSI/NIST-ITL, type 9", (".an2", ".an2k", ".eft"), _recognises, decode)
