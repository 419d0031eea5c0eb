"""Two CSV formats: fpmatch's own, readable and editable, and a plain one for other programs.

Files of fpmatch's own format look like this::

    # fpmatch-template 1 width=388 height=374 dpi=500
    # pixels from the top left, y down; angle_deg counter-clockwise on screen from +x
    x,y,angle_deg,kind,quality
    101,57.5,278.4,ending,90

and plain ones like this::

    x,y,theta,type,quality
    101,57.5,278.4,E,90

Directions, in degrees, are those of ISO/IEC 19794-2: for an ending, from the minutia back along its
ridge; for a bifurcation, along the valley between its two close branches. Kinds are other, ending
and bifurcation, types U, E and B; quality runs from 0 to 100. The ridge field is not kept.

A plain file contains neither size nor resolution. On reading, its type and quality may be missing,
its columns may have any order, and other columns are ignored.
"""

from __future__ import annotations

import csv
import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import LARGEST, Codec, dropped_notes, minutiae_from_columns, side
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
from fpmatch.minutiae import MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from fpmatch.minutiae import Minutiae

DIGITS: Final = 9  # significant digits that restore a float32 exactly
MAGIC: Final = "# fpmatch-template"
VERSION: Final = "1"
CONVENTION: Final = (
    "# pixels from the top left, y down; angle_deg counter-clockwise on screen from +x"
)
COLUMNS: Final = ["x", "y", "angle_deg", "kind", "quality"]
PLAIN_COLUMNS: Final = ["x", "y", "theta", "type", "quality"]
KINDS: Final = {kind.name.lower(): kind.value for kind in MinutiaKind}
TYPES: Final = {"u": MinutiaKind.OTHER, "e": MinutiaKind.ENDING, "b": MinutiaKind.BIFURCATION}
_ABSENT: Final = {"type": "U", "quality": "100"}  # in plain files without these columns
_BYTE_ORDER_MARK: Final = b"\xef\xbb\xbf"


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of fpmatch's own format, and notes on what they cannot hold."""
    view = record.single()
    template, m = view.template, view.template.minutiae
    frame = f"width={template.width} height={template.height} dpi={template.dpi:.17g}"
    lines = [f"{MAGIC} {VERSION} {frame}", CONVENTION, ",".join(COLUMNS)]
    for place, kind, quality in zip(_places(m), m.kind, m.quality, strict=True):
        lines.append(f"{place},{MinutiaKind(kind).name.lower()},{quality}")
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(dropped_notes(view, field=True)))


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the template in a file of fpmatch's own format, or raise TemplateError."""
    lines = _lines(data)
    width, height, dpi = _frame(lines[0] if lines else "")
    rows = (
        (number, _cells(number, line))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.startswith("#")
    )
    number, header = next(rows, (len(lines), []))
    if header != COLUMNS:
        raise TemplateError(f"line {number}: expected the columns {','.join(COLUMNS)}")
    options.limits.check_size(width, height)
    x, y, degrees, kind, quality = _table(rows, header, COLUMNS, KINDS, options)
    minutiae = minutiae_from_columns(x, y, np.radians(degrees), kind, quality)
    return TemplateRecord(CODEC.name, (View(Template(minutiae, width, height, dpi)),))


def encode_plain(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of the plain format, and notes on what they cannot hold."""
    view = record.single()
    m = view.template.minutiae
    notes = ["size and resolution dropped", *dropped_notes(view, field=True)]
    letters = {kind: letter.upper() for letter, kind in TYPES.items()}
    lines = [",".join(PLAIN_COLUMNS if view.quality_known else PLAIN_COLUMNS[:-1])]
    for place, kind, quality in zip(_places(m), m.kind, m.quality, strict=True):
        cells = [place, letters[MinutiaKind(kind)]]
        lines.append(",".join([*cells, str(quality)] if view.quality_known else cells))
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(notes))


def decode_plain(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a plain file, or raise TemplateError."""
    lines = _lines(data)
    header = [name.lower() for name in _cells(1, lines[0])] if lines else []
    if not set(PLAIN_COLUMNS[:3]) <= set(header) or len(set(header)) < len(header):
        raise TemplateError(f"line 1: expected the columns {','.join(PLAIN_COLUMNS)}, each once")
    rows = (
        (number, _cells(number, line))
        for number, line in enumerate(lines[1:], start=2)
        if line.strip()
    )
    x, y, theta, kind, quality = _table(rows, header, PLAIN_COLUMNS, TYPES, options)
    width, height = options.size or (side(x), side(y))
    options.limits.check_size(width, height)
    minutiae = minutiae_from_columns(x, y, np.radians(theta), kind, quality)
    view = View(
        Template(minutiae, width, height, options.assumed_dpi),
        dpi_known=False,
        size_known=False,
        quality_known="quality" in header,
    )
    return TemplateRecord(PLAIN_CODEC.name, (view,))


def _lines(data: bytes) -> list[str]:
    """Return the lines of a file; raises TemplateError unless it is UTF-8 text."""
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise TemplateError(f"not UTF-8 text (byte {error.start})") from error


def _cells(number: int, line: str) -> list[str]:
    """Return the cells of line `number`, stripped."""
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise TemplateError(f"line {number}: {error}") from error


def _frame(line: str) -> tuple[int, int, float]:
    """Return width, height and dpi from the first line."""
    if line.removeprefix(MAGIC).split()[:1] != [VERSION]:
        raise TemplateError(f"line 1: unknown version of the format (known: {VERSION})")
    values = dict(re.findall(r"(\w+)=([^\s,]+)", line))
    try:
        return int(values["width"]), int(values["height"]), float(values["dpi"])
    except (KeyError, ValueError) as error:
        raise TemplateError("line 1: expected width=, height= and dpi= as numbers") from error


def _table(
    rows: Iterable[tuple[int, list[str]]],
    header: list[str],
    columns: list[str],
    kinds: Mapping[str, int],
    options: ReadingOptions,
) -> Any:
    """Return the numbers in `columns`, shape (5, N), of rows given by number and cells."""
    table: list[list[float]] = []
    for number, cells in rows:
        options.limits.check_minutiae(len(table) + 1)
        if len(cells) != len(header):
            raise TemplateError(f"line {number}: expected {len(header)} values, found {len(cells)}")
        row = _ABSENT | dict(zip(header, cells, strict=True))
        x, y, angle, kind, quality = (row[name] for name in columns)
        if kind.lower() not in kinds:
            raise TemplateError(
                f"line {number}: unknown {columns[3]} of minutia {kind!r} (known: "
                f"{', '.join(kinds)})"
            )
        try:
            values = [*map(float, (x, y, angle)), kinds[kind.lower()], float(quality)]
        except ValueError as error:
            raise TemplateError(f"line {number}: {error}") from error
        if not all(abs(value) <= LARGEST for value in values[:3]) or not 0 <= values[4] <= 100:
            raise TemplateError(f"line {number}: a value is not finite, or a quality not in 0..100")
        table.append(values)
    return np.array(table, dtype=np.float64).reshape(-1, len(columns)).T


def _places(minutiae: Minutiae) -> Iterator[str]:
    """Yield x, y and direction in degrees of each minutia, separated by commas."""
    degrees = np.degrees(minutiae.angle.astype(np.float64))
    for place in zip(minutiae.x, minutiae.y, degrees, strict=True):
        yield ",".join(f"{float(value):.{DIGITS}g}" for value in place)


def _recognises(data: bytes) -> bool:
    return data.removeprefix(_BYTE_ORDER_MARK).startswith(MAGIC.encode())


def _recognises_plain(data: bytes) -> bool:
    """Return whether the first line names the columns."""
    first = data.removeprefix(_BYTE_ORDER_MARK).split(b"\n", 1)[0][:1000]
    names = {name.strip().strip('"').lower() for name in first.decode("latin-1").split(",")}
    return set(PLAIN_COLUMNS[:3]) <= names


CODEC: Final = Codec("csv", "fpmatch CSV 1", (".csv",), _recognises, decode, encode)
PLAIN_CODEC: Final = Codec(
    "minutiae-csv",
    "CSV of x, y, theta",
    (".csv",),
    _recognises_plain,
    decode_plain,
    encode_plain,
)
