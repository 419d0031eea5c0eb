"""Plain CSV for exchange with other programs: one header of column names, no comments.

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
from fpmatch.formats.codec import Codec, dropped_notes, minutiae_from_columns
from fpmatch.formats.csv_format import format_places, parse_numbers, split_cells, split_lines
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
from fpmatch.minutiae import STANDARD_DPI, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Mapping

NUMBERS: Final = ("x", "y", "theta")
COLUMNS: Final = (*NUMBERS, "type", "quality")
LETTER: Final = {MinutiaKind.ENDING: "E", MinutiaKind.BIFURCATION: "B", MinutiaKind.OTHER: "U"}
_KIND: Final = {letter: kind for kind, letter in LETTER.items()}


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold."""
    view = record.single()
    m = view.template.minutiae
    notes = ["size and resolution dropped", *dropped_notes(view, field=True)]
    lines = [",".join(COLUMNS if view.quality_known else COLUMNS[:-1])]
    for place, kind, quality in zip(format_places(m), m.kind, m.quality, strict=True):
        cells = [place, LETTER[MinutiaKind(kind)]]
        lines.append(",".join([*cells, str(quality)] if view.quality_known else cells))
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(notes))


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a file, or raise TemplateError."""
    lines = split_lines(data)
    header = [name.lower() for name in split_cells(1, lines[0])] if lines else []
    if not set(NUMBERS) <= set(header) or len(set(header)) < len(header):
        raise TemplateError(f"line 1: expected the columns {','.join(COLUMNS)}, each once")
    table: list[tuple[float, ...]] = []
    for number, line in enumerate(lines[1:], start=2):
        if line.strip():
            options.limits.check_minutiae(len(table) + 1)
            table.append(_minutia(number, header, split_cells(number, line)))
    x, y, theta, kind, quality = np.array(table, dtype=np.float64).reshape(-1, len(COLUMNS)).T
    width, height = options.size or (_room(x), _room(y))
    options.limits.check_size(width, height)
    minutiae = minutiae_from_columns(x, y, np.radians(theta), kind, np.rint(quality))
    view = View(
        Template(minutiae, width, height, STANDARD_DPI if options.dpi is None else options.dpi),
        dpi_known=False,
        size_known=False,
        quality_known="quality" in header,
    )
    return TemplateRecord(CODEC.name, (view,))


def _minutia(number: int, header: list[str], cells: list[str]) -> tuple[float, ...]:
    """Return the numbers of one line, with the code of its kind."""
    if len(cells) != len(header):
        raise TemplateError(f"line {number}: expected {len(header)} values, found {len(cells)}")
    row: Mapping[str, str] = dict(zip(header, cells, strict=True))
    letter = row.get("type", "U").upper()
    if letter not in _KIND:
        raise TemplateError(f"line {number}: a type {row['type']!r}; known are E, B and U")
    place = [row[name] for name in NUMBERS]
    x, y, theta, quality = parse_numbers(number, place, row.get("quality", "100"))
    return x, y, theta, _KIND[letter].value, quality


def _room(positions: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> int:
    """Return the smallest side of an image that contains the positions."""
    return int(np.clip(positions.max(initial=0), 0, 2**31)) + 1


def _recognises(data: bytes) -> bool:
    """Return whether the first line names the columns."""
    first = data.removeprefix(b"\xef\xbb\xbf").split(b"\n", 1)[0][:1000]
    names = {name.strip().strip('"').lower() for name in first.decode("latin-1").split(",")}
    return set(NUMBERS) <= names


CODEC: Final = Codec("minutiae-csv", "CSV of x, y, theta", (".csv",), _recognises, decode, encode)
