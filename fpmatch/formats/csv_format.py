"""fpmatch's own CSV format, readable and editable, and the CSV functions that formats share.

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

import csv
import re
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import LARGEST, Codec, dropped_notes, minutiae_from_columns
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
from fpmatch.minutiae import MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fpmatch.minutiae import Minutiae

DIGITS: Final = 9  # significant digits that restore a float32 exactly
MAGIC: Final = "# fpmatch-template"
VERSION: Final = "1"
CONVENTION: Final = (
    "# pixels from the top left, y down; angle_deg counter-clockwise on screen from +x"
)
COLUMNS: Final = ["x", "y", "angle_deg", "kind", "quality"]


def split_lines(data: bytes) -> list[str]:
    """Return the lines of a file; raises TemplateError unless it is UTF-8 text."""
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise TemplateError(f"not UTF-8 text (byte {error.start})") from error


def split_cells(number: int, line: str) -> list[str]:
    """Return the cells of line `number`, stripped."""
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise TemplateError(f"line {number}: {error}") from error


def format_places(minutiae: Minutiae) -> Iterator[str]:
    """Yield x, y and direction in degrees of each minutia, separated by commas."""
    degrees = np.degrees(minutiae.angle.astype(np.float64))
    for place in zip(minutiae.x, minutiae.y, degrees, strict=True):
        yield ",".join(f"{float(value):.{DIGITS}g}" for value in place)


def parse_numbers(number: int, place: Sequence[str], quality: str) -> tuple[float, ...]:
    """Return x, y, direction and quality of line `number`; raises TemplateError if invalid."""
    try:
        x, y, angle, grade = map(float, [*place, quality])
    except ValueError as error:
        raise TemplateError(f"line {number}: {error}") from error
    if not all(abs(value) <= LARGEST for value in (x, y, angle)) or not 0 <= grade <= 100:
        raise TemplateError(f"line {number}: a value is not finite, or a quality not in 0..100")
    return x, y, angle, grade


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold."""
    view = record.single()
    template, m = view.template, view.template.minutiae
    frame = f"width={template.width} height={template.height} dpi={template.dpi:.17g}"
    lines = [f"{MAGIC} {VERSION} {frame}", CONVENTION, ",".join(COLUMNS)]
    for place, kind, quality in zip(format_places(m), m.kind, m.quality, strict=True):
        lines.append(f"{place},{MinutiaKind(kind).name.lower()},{quality}")
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(dropped_notes(view, field=True)))


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the template in a file, or raise TemplateError."""
    lines = split_lines(data)
    width, height, dpi = _frame(lines[0] if lines else "")
    rows = (
        (number, split_cells(number, line))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.startswith("#")
    )
    number, header = next(rows, (len(lines), []))
    if header != COLUMNS:
        raise TemplateError(f"line {number}: expected the columns {','.join(COLUMNS)}")
    options.limits.check_size(width, height)
    table: list[tuple[float, ...]] = []
    for number, row in rows:
        options.limits.check_minutiae(len(table) + 1)
        table.append(_minutia(number, row))
    x, y, degrees, kind, quality = np.array(table, dtype=np.float64).reshape(-1, len(COLUMNS)).T
    minutiae = minutiae_from_columns(x, y, np.radians(degrees), kind, quality)
    return TemplateRecord(CODEC.name, (View(Template(minutiae, width, height, dpi)),))


def _frame(line: str) -> tuple[int, int, float]:
    """Return width, height and dpi from the first line."""
    if line.removeprefix(MAGIC).split()[:1] != [VERSION]:
        raise TemplateError(f"line 1: unknown version of the format (known: {VERSION})")
    values = dict(re.findall(r"(\w+)=([^\s,]+)", line))
    try:
        return int(values["width"]), int(values["height"]), float(values["dpi"])
    except (KeyError, ValueError) as error:
        raise TemplateError("line 1: expected width=, height= and dpi= as numbers") from error


def _minutia(number: int, row: list[str]) -> tuple[float, float, float, float, float]:
    """Return the numbers of one row, with the code of its kind."""
    if len(row) != len(COLUMNS):
        raise TemplateError(f"line {number}: expected {len(COLUMNS)} values, found {len(row)}")
    *position, kind, quality = row
    if kind.upper() not in MinutiaKind.__members__:
        raise TemplateError(f"line {number}: unknown kind of minutia {kind!r}")
    x, y, angle, grade = parse_numbers(number, position, quality)
    return x, y, angle, MinutiaKind[kind.upper()].value, grade


def _recognises(data: bytes) -> bool:
    return data.removeprefix(b"\xef\xbb\xbf").startswith(MAGIC.encode())


CODEC: Final = Codec("csv", "fpmatch CSV 1", (".csv",), _recognises, decode, encode)
