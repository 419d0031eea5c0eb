"""Minutiae as plain CSV: one header of column names, degrees, no comments; for other programs.

A file looks like this::

    x,y,theta,type,quality
    101,57.5,278.4,E,90

x and y are pixels from the top left, y down. theta is in degrees, counter-clockwise on screen
from +x, with the direction of ISO/IEC 19794-2: for an ending, from the minutia back along its
ridge. type is E for an ending, B for a bifurcation, U for any other; quality runs from 0 to 100.
On reading, type and quality may be missing, the columns may have any order, and other columns are
read past. A file tells neither size nor resolution.
"""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import LARGEST, Codec
from fpmatch.formats.columns import minutiae_of
from fpmatch.formats.record import Encoded, Reading, TemplateRecord, View
from fpmatch.minutiae import STANDARD_DPI, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Mapping

NUMBERS: Final = ("x", "y", "theta")
COLUMNS: Final = (*NUMBERS, "type", "quality")
LETTER: Final = {MinutiaKind.ENDING: "E", MinutiaKind.BIFURCATION: "B", MinutiaKind.OTHER: "U"}
DIGITS: Final = 9  # significant digits that give back the same float32
_KIND: Final = {letter: kind for kind, letter in LETTER.items()}


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as the bytes of a CSV file, and what they could not hold."""
    view = record.single()
    m = view.template.minutiae
    notes = ["size and resolution dropped"]
    if view.template.field is not None:
        notes.append("the ridge field dropped")
    if view.extended is not None:
        notes.append(f"extended data of {view.extended.layout} dropped")
    last = len(COLUMNS) if view.quality_known else len(COLUMNS) - 1
    lines = [",".join(COLUMNS[:last])]
    degrees = np.degrees(m.angle.astype(np.float64))
    for x, y, theta, kind, quality in zip(m.x, m.y, degrees, m.kind, m.quality, strict=True):
        cells = [f"{float(value):.{DIGITS}g}" for value in (x, y, theta)]
        lines.append(",".join([*cells, LETTER[MinutiaKind(kind)], str(quality)][:last]))
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(notes))


def decode(data: bytes, how: Reading) -> TemplateRecord:
    """Return the minutiae that the bytes of a CSV file hold, or raise TemplateError."""
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise TemplateError(f"not UTF-8 text (byte {error.start})") from error
    header = _header(lines[0]) if lines else []
    if not set(NUMBERS) <= set(header) or len(set(header)) < len(header):
        raise TemplateError(f"line 1: expected the columns {','.join(COLUMNS)}, each once")
    table: list[tuple[float, ...]] = []
    for number, line in enumerate(lines[1:], start=2):
        if line.strip():
            how.limits.check_minutiae(len(table) + 1)
            table.append(_minutia(number, header, _cells(number, line)))
    x, y, theta, kind, quality = np.array(table, dtype=np.float64).reshape(-1, len(COLUMNS)).T
    width, height = how.size or (_room(x), _room(y))
    how.limits.check_size(width, height)
    minutiae = minutiae_of(x, y, np.radians(theta), kind, np.rint(quality))
    view = View(
        Template(minutiae, width, height, STANDARD_DPI if how.dpi is None else how.dpi),
        dpi_known=False,
        size_known=False,
        quality_known="quality" in header,
    )
    return TemplateRecord(CODEC.name, (view,))


def _minutia(number: int, header: list[str], cells: list[str]) -> tuple[float, ...]:
    """Return the numbers of one line, its type as the code of the kind."""
    if len(cells) != len(header):
        raise TemplateError(f"line {number}: expected {len(header)} values, found {len(cells)}")
    row: Mapping[str, str] = dict(zip(header, cells, strict=True))
    letter = row.get("type", "U").upper()
    if letter not in _KIND:
        raise TemplateError(f"line {number}: a type {row['type']!r}; known are E, B and U")
    try:
        x, y, theta = (float(row[name]) for name in NUMBERS)
        quality = float(row.get("quality", 100))
    except ValueError as error:
        raise TemplateError(f"line {number}: {error}") from error
    if not all(abs(value) <= LARGEST for value in (x, y, theta)) or not 0 <= quality <= 100:
        raise TemplateError(f"line {number}: a value is not finite, or a quality not in 0..100")
    return x, y, theta, _KIND[letter].value, quality


def _room(positions: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> int:
    """Return the least side of an image that has room for the positions."""
    return int(np.clip(positions.max(initial=0), 0, 2**31)) + 1


def _header(line: str) -> list[str]:
    return [name.lower() for name in _cells(1, line)]


def _cells(number: int, line: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise TemplateError(f"line {number}: {error}") from error


def _recognises(data: bytes) -> bool:
    """Tell whether the first line names the columns."""
    first = data.removeprefix(b"\xef\xbb\xbf").split(b"\n", 1)[0][:1000]
    names = {name.strip().strip('"').lower() for name in first.decode("latin-1").split(",")}
    return set(NUMBERS) <= names


CODEC: Final = Codec("minutiae-csv", "CSV of x, y, theta", (".csv",), _recognises, decode, encode)
