"""Minutiae as plain CSV: one header of column names, degrees, no comments; for other programs.

A file looks like this::

    x,y,theta,type,quality
    101,57.5,278.4,E,90

x and y are pixels from the top left, y down. theta is in degrees, counter-clockwise on screen
from +x, with the direction of ISO/IEC 19794-2: for an ending, from the minutia back along its
ridge. type is E for an ending, B for a bifurcation, U for any other; quality runs from 0 to 100.
On reading, type and quality may be missing, the columns may have any order, and other columns are
ignored. A file contains neither size nor resolution.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import Codec
from fpmatch.formats.columns import minutiae_of
from fpmatch.formats.csv_lines import cells_of, lines_of, numbers_of, places_in_words
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
from fpmatch.minutiae import STANDARD_DPI, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Mapping

NUMBERS: Final = ("x", "y", "theta")
COLUMNS: Final = (*NUMBERS, "type", "quality")
LETTER: Final = {MinutiaKind.ENDING: "E", MinutiaKind.BIFURCATION: "B", MinutiaKind.OTHER: "U"}
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
    lines = [",".join(COLUMNS if view.quality_known else COLUMNS[:-1])]
    for place, kind, quality in zip(places_in_words(m), m.kind, m.quality, strict=True):
        cells = [place, LETTER[MinutiaKind(kind)]]
        lines.append(",".join([*cells, str(quality)] if view.quality_known else cells))
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(notes))


def decode(data: bytes, how: ReadingOptions) -> TemplateRecord:
    """Return the minutiae that the bytes of a CSV file hold, or raise TemplateError."""
    lines = lines_of(data)
    header = [name.lower() for name in cells_of(1, lines[0])] if lines else []
    if not set(NUMBERS) <= set(header) or len(set(header)) < len(header):
        raise TemplateError(f"line 1: expected the columns {','.join(COLUMNS)}, each once")
    table: list[tuple[float, ...]] = []
    for number, line in enumerate(lines[1:], start=2):
        if line.strip():
            how.limits.check_minutiae(len(table) + 1)
            table.append(_minutia(number, header, cells_of(number, line)))
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
    place = [row[name] for name in NUMBERS]
    x, y, theta, quality = numbers_of(number, place, row.get("quality", "100"))
    return x, y, theta, _KIND[letter].value, quality


def _room(positions: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> int:
    """Return the least side of an image that has room for the positions."""
    return int(np.clip(positions.max(initial=0), 0, 2**31)) + 1


def _recognises(data: bytes) -> bool:
    """Tell whether the first line names the columns."""
    first = data.removeprefix(b"\xef\xbb\xbf").split(b"\n", 1)[0][:1000]
    names = {name.strip().strip('"').lower() for name in first.decode("latin-1").split(",")}
    return set(NUMBERS) <= names


CODEC: Final = Codec("minutiae-csv", "CSV of x, y, theta", (".csv",), _recognises, decode, encode)
