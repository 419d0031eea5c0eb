"""Templates as CSV, for eyes and spreadsheets.

A file looks like this::

    # fpmatch-template 1 width=388 height=374 dpi=500
    # pixels from the top left, y down; angle_deg counter-clockwise on screen from +x
    x,y,angle_deg,kind,quality
    101,57.5,278.4,ending,90

Directions are those of ISO/IEC 19794-2: for an ending, from the minutia back along its ridge; for
a bifurcation, along the valley between its two close branches. Kinds are other, ending and
bifurcation; quality runs from 0 to 100. The ridge field is not kept.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import Codec
from fpmatch.formats.columns import minutiae_of
from fpmatch.formats.csv_lines import cells_of, lines_of, numbers_of, places_in_words
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
from fpmatch.minutiae import MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Iterator

MAGIC: Final = "# fpmatch-template"
VERSION: Final = "1"
CONVENTION: Final = (
    "# pixels from the top left, y down; angle_deg counter-clockwise on screen from +x"
)
COLUMNS: Final = ["x", "y", "angle_deg", "kind", "quality"]


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as the bytes of a CSV file, and what they could not hold."""
    view = record.single()
    template, m = view.template, view.template.minutiae
    notes = [] if template.field is None else ["the ridge field dropped"]
    if view.extended is not None:
        notes.append(f"extended data of {view.extended.layout} dropped")
    frame = f"width={template.width} height={template.height} dpi={template.dpi:.17g}"
    lines = [f"{MAGIC} {VERSION} {frame}", CONVENTION, ",".join(COLUMNS)]
    for place, kind, quality in zip(places_in_words(m), m.kind, m.quality, strict=True):
        lines.append(f"{place},{MinutiaKind(kind).name.lower()},{quality}")
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(notes))


def decode(data: bytes, how: ReadingOptions) -> TemplateRecord:
    """Return the template that the bytes of a CSV file hold, or raise TemplateError."""
    lines = lines_of(data)
    width, height, dpi = _frame(lines[0] if lines else "")
    rows = _rows(lines)
    number, header = next(rows, (len(lines), []))
    if header != COLUMNS:
        raise TemplateError(f"line {number}: expected the columns {','.join(COLUMNS)}")
    how.limits.check_size(width, height)
    table: list[tuple[float, ...]] = []
    for number, row in rows:
        how.limits.check_minutiae(len(table) + 1)
        table.append(_minutia(number, row))
    x, y, degrees, kind, quality = np.array(table, dtype=np.float64).reshape(-1, len(COLUMNS)).T
    minutiae = minutiae_of(x, y, np.radians(degrees), kind, quality)
    return TemplateRecord(CODEC.name, (View(Template(minutiae, width, height, dpi)),))


def _recognises(data: bytes) -> bool:
    return data.removeprefix(b"\xef\xbb\xbf").startswith(MAGIC.encode())


def _frame(line: str) -> tuple[int, int, float]:
    """Return width, height and dpi from the first line."""
    version = line.removeprefix(MAGIC).split()[:1]
    if version != [VERSION]:
        raise TemplateError(f"line 1: unknown version of the format (known: {VERSION})")
    values = dict(re.findall(r"(\w+)=([^\s,]+)", line))
    try:
        return int(values["width"]), int(values["height"]), float(values["dpi"])
    except (KeyError, ValueError) as error:
        raise TemplateError("line 1: expected width=, height= and dpi= as numbers") from error


def _rows(lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield number and cells of each line that is neither a comment nor blank."""
    for number, line in enumerate(lines, start=1):
        if line.strip() and not line.startswith("#"):
            yield number, cells_of(number, line)


def _minutia(number: int, row: list[str]) -> tuple[float, float, float, float, float]:
    """Return the numbers of one row, its kind as a code."""
    if len(row) != len(COLUMNS):
        raise TemplateError(f"line {number}: expected {len(COLUMNS)} values, found {len(row)}")
    *position, kind, quality = row
    if kind.upper() not in MinutiaKind.__members__:
        raise TemplateError(f"line {number}: unknown kind of minutia {kind!r}")
    x, y, angle, grade = numbers_of(number, position, quality)
    return x, y, angle, MinutiaKind[kind.upper()].value, grade


CODEC: Final = Codec("csv", "fpmatch CSV 1", (".csv",), _recognises, decode, encode)
