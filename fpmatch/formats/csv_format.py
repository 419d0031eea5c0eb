"""fpmatch's own CSV format, readable and editable.

Files look like this::

    # fpmatch-template 1 width=388 height=374 dpi=500
    # pixels from the top left, y down; angle_deg counter-clockwise on screen from +x
    x,y,angle_deg,kind,quality
    101,57.5,278.4,ending,90

Directions, in degrees, follow ISO/IEC 19794-2: for an ending, from the minutia back along its
ridge; for a bifurcation, along the valley between its two close branches. Kinds are other, ending
and bifurcation; quality runs from 0 to 100. The ridge field is not kept. ``dpi_known=false``
follows the resolution of a print where nothing states it.
"""

from __future__ import annotations

import csv
import re
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import LARGEST, Codec, dropped_notes, minutiae_from_columns
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
from fpmatch.templates.minutiae import MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from fpmatch.templates.minutiae import Minutiae

DIGITS: Final = 9  # significant digits that restore a float32 exactly
MAGIC: Final = "# fpmatch-template"
VERSION: Final = "1"
CONVENTION: Final = (
    "# pixels from the top left, y down; angle_deg counter-clockwise on screen from +x"
)
COLUMNS: Final = ["x", "y", "angle_deg", "kind", "quality"]
KINDS: Final = {kind.name.lower(): kind.value for kind in MinutiaKind}
BYTE_ORDER_MARK: Final = b"\xef\xbb\xbf"


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of fpmatch's own format, and notes on what they cannot hold."""
    view = record.single()
    template, m = view.template, view.template.minutiae
    frame = f"width={template.width} height={template.height} dpi={template.dpi:.17g}"
    frame += " dpi_known=false" * (not template.dpi_known)
    lines = [f"{MAGIC} {VERSION} {frame}", CONVENTION, ",".join(COLUMNS)]
    for place, kind, quality in zip(places_of(m), m.kind, m.quality, strict=True):
        lines.append(f"{place},{MinutiaKind(kind).name.lower()},{quality}")
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(dropped_notes(view, field=True)))


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the template in a file of fpmatch's own format, or raise TemplateError."""
    lines = text_lines(data)
    frame = _frame(lines[0] if lines else "")
    rows = (
        (number, cells_of(number, line))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.startswith("#")
    )
    number, header = next(rows, (len(lines), []))
    if header != COLUMNS:
        raise TemplateError(f"line {number}: expected the columns {','.join(COLUMNS)}")
    options.limits.check_size(frame["width"], frame["height"])
    x, y, degrees, kind, quality = read_table(rows, header, COLUMNS, KINDS, options)
    minutiae = minutiae_from_columns(x, y, np.radians(degrees), kind, quality)
    return TemplateRecord(CODEC.name, (View(Template(minutiae, **frame)),))


def text_lines(data: bytes) -> list[str]:
    """Return the lines of a file; raises TemplateError unless it is UTF-8 text."""
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise TemplateError(f"not UTF-8 text (byte {error.start})") from error


def cells_of(number: int, line: str, delimiter: str = ",") -> list[str]:
    """Return the cells of line `number`, stripped."""
    try:
        reader = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
        return [cell.strip() for cell in next(reader)]
    except csv.Error as error:
        raise TemplateError(f"line {number}: {error}") from error


def _frame(line: str) -> dict[str, Any]:
    """Return width, height and dpi from the first line, and whether the dpi is known."""
    if line.removeprefix(MAGIC).split()[:1] != [VERSION]:
        raise TemplateError(f"line 1: unknown version of the format (known: {VERSION})")
    values = dict(re.findall(r"(\w+)=([^\s,]+)", line))
    try:
        frame = {"width": int(values["width"]), "height": int(values["height"])}
        return frame | {
            "dpi": float(values["dpi"]),
            "dpi_known": values.get("dpi_known") != "false",
        }
    except (KeyError, ValueError) as error:
        raise TemplateError("line 1: expected width=, height= and dpi= as numbers") from error


def read_table(
    rows: Iterable[tuple[int, list[str]]],
    header: list[str],
    columns: Sequence[str],
    kinds: Mapping[str, int],
    options: ReadingOptions,
    absent: Mapping[str, str] = MappingProxyType({}),
) -> Any:
    """Return the numbers in `columns`, shape (5, N), of rows given by number and cells.

    The columns are x, y, angle, kind and quality by the names of the file, which are also those of
    `header`; `absent` has the values of those that may be missing.
    """
    table: list[list[float]] = []
    for number, cells in rows:
        options.limits.check_minutiae(len(table) + 1)
        if len(cells) != len(header):
            raise TemplateError(f"line {number}: expected {len(header)} values, found {len(cells)}")
        row = {**absent, **dict(zip(header, cells, strict=True))}
        kind = row[columns[3]]
        word = re.sub(r"[ -]", "_", kind.lower())
        if word not in kinds:
            raise TemplateError(
                f"line {number}: unknown {columns[3]} of minutia {kind!r} (known: "
                f"{', '.join(kinds)})"
            )
        x, y, angle, quality = (
            parse_number(row[name], number, name) for name in (*columns[:3], columns[4])
        )
        if not 0 <= quality <= 100:
            raise TemplateError(f"line {number}, column {columns[4]}: {quality:g} is not in 0..100")
        table.append([x, y, angle, kinds[word], quality])
    return np.array(table, dtype=np.float64).reshape(-1, len(columns)).T


def parse_number(text: str, line: int, column: str) -> float:
    """Return a finite number that float32 can hold; raises TemplateError that names its place."""
    try:
        value = float(text)
    except ValueError as error:
        shown = repr(text) if text else "nothing"
        raise TemplateError(
            f"line {line}, column {column}: expected a number, found {shown}"
        ) from error
    if not abs(value) <= LARGEST:
        raise TemplateError(f"line {line}, column {column}: {value:g} is not finite")
    return value


def places_of(minutiae: Minutiae) -> Iterator[str]:
    """Yield x, y and direction in degrees of each minutia, separated by commas."""
    degrees = np.degrees(minutiae.angle.astype(np.float64))
    for place in zip(minutiae.x, minutiae.y, degrees, strict=True):
        yield ",".join(f"{float(value):.{DIGITS}g}" for value in place)


def _recognises(data: bytes) -> bool:
    return data.removeprefix(BYTE_ORDER_MARK).startswith(MAGIC.encode())


CODEC: Final = Codec("csv", "fpmatch CSV 1", (".csv",), _recognises, decode, encode)
