"""Tables of minutiae: fpmatch's own CSV, readable and editable, tables of others, bare numbers.

Files of fpmatch's own format look like this::

    # fpmatch-template 1 width=388 height=374 dpi=500
    # pixels from the top left, y down; angle_deg counter-clockwise on screen from +x
    x,y,angle_deg,kind,quality
    101,57.5,278.4,ending,90

Directions, in degrees, follow ISO/IEC 19794-2: for an ending, from the minutia back along its
ridge; for a bifurcation, along the valley between its two close branches. Kinds are other, ending
and bifurcation; quality runs from 0 to 100. The ridge field is not kept. ``dpi_known=false``
follows the resolution of a print where nothing states it.

Tables of other programs contain neither size nor resolution. fpmatch writes them like this::

    x,y,theta,type,quality
    101,57.5,278.4,E,90

Positions are pixels from the top left, y down. Angles in a column theta are degrees in fpmatch's
own convention, and so are angles in a column whose name contains the unit (angle_deg,
direction_rad). For another name, `ReadingOptions.angles` must define them. On reading, type and
quality may be missing, the columns may have any order, and other columns are ignored. Comma,
semicolon, tab or spaces separate them, and the header may begin with #.

Tables without a header are arrays of numpy, as text of `np.savetxt` or as `.npy`. Each row is a
minutia: x, y, its angle, and perhaps its quality. `ReadingOptions.angles` must define how angles
are measured. Numbers of a text are separated by spaces, tabs, commas or semicolons; lines that
begin with # are left out. A file contains neither size, resolution nor kinds.
"""

from __future__ import annotations

import csv
import re
from itertools import chain
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.base.npy import decode_npy, is_npy
from fpmatch.errors import TemplateError
from fpmatch.formats.record import (
    OWN_DEGREES,
    UNKNOWN,
    AngleConvention,
    Codec,
    Encoded,
    ReadingOptions,
    TemplateRecord,
    View,
    check_minutiae,
    dropped_notes,
    range_notes,
    span,
)
from fpmatch.templates.minutiae import LARGEST, Minutiae, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

DIGITS: Final = 9  # significant digits that restore a float32 exactly
MAGIC: Final = "# fpmatch-template"
VERSION: Final = "1"
CONVENTION: Final = (
    "# pixels from the top left, y down; angle_deg counter-clockwise on screen from +x"
)
COLUMNS: Final = ["x", "y", "angle_deg", "kind", "quality"]
PLAIN_COLUMNS: Final = ["x", "y", "theta", "type", "quality"]
OWN_NAMES: Final = dict(zip(PLAIN_COLUMNS, COLUMNS, strict=True))
NUMBER_NAMES: Final = {"x": "x", "y": "y", "theta": "angle", "quality": "quality"}
BYTE_ORDER_MARK: Final = b"\xef\xbb\xbf"
LONGEST_HEADER: Final = 1000
_WORDS: Final = {  # of fpmatch and of other programs; 3 is a crossing number
    MinutiaKind.OTHER: ("u", "0", "other", "unknown", "none", "crossover"),
    MinutiaKind.ENDING: ("e", "1", "ending", "end", "termination", "ridge_ending"),
    MinutiaKind.BIFURCATION: ("b", "2", "3", "bifurcation", "bif", "fork", "ridge_bifurcation"),
}
_KINDS: Final = {word: kind for kind, words in _WORDS.items() for word in words}
_ANGLE: Final = re.compile(
    r"(theta|angle|direction|orientation)[ _(\[]*(?P<unit>deg|rad)?(rees?|ians?)?[)\]]?"
)
_NAMES: Final = {
    "theta": _ANGLE,
    "x": re.compile("x"),
    "y": re.compile("y"),
    "type": re.compile("type|kind"),
    "quality": re.compile("quality"),
}
_NUMBER: Final = rb"[-+]?(\d{1,40}\.?\d{0,40}|\.\d{1,40})([eE][-+]?\d{1,3})?"
_BETWEEN: Final = rb"([ \t]*[,;\t ][ \t]*)"
_ROW: Final = re.compile(rb"[ \t]*%b(%b%b){2,3}[ \t]*\r?(\n|$)" % (_NUMBER, _BETWEEN, _NUMBER))
_SEPARATOR: Final = re.compile(r"\s*[,;]\s*|\s+")
_COMMENTS: Final = re.compile(rb"([ \t]*(#[^\n]*)?\r?\n)*")


class _Header(NamedTuple):
    """Names of a header as the file has them, in lower case, and what the known columns mean."""

    line: int
    delimiter: str
    names: list[str]
    given: dict[str, str]  # the name that the file gives to column x, y, theta, type, quality


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of fpmatch's own format, and notes on what they cannot hold."""
    view = record.single()
    template = view.template
    frame = f"width={template.width} height={template.height} dpi={template.dpi:.17g}"
    frame += " dpi_known=false" * (not template.dpi_known)
    head = [f"{MAGIC} {VERSION} {frame}", CONVENTION, ",".join(COLUMNS)]
    lines = [",".join(row) for row in _cells_of(view, ("other", "ending", "bifurcation"))]
    text = "\n".join([*head, *lines, ""])
    return Encoded(text.encode(), tuple(dropped_notes(view, field=True)))


def encode_plain(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of the plain format, and notes on what they cannot hold."""
    view = record.single()
    width = len(PLAIN_COLUMNS) - (not view.quality_known)
    rows = [PLAIN_COLUMNS, *_cells_of(view, "UEB")]
    text = "".join(",".join(row[:width]) + "\n" for row in rows)
    notes = ["size and resolution dropped", *dropped_notes(view, field=True)]
    return Encoded(text.encode(), tuple(notes))


def _cells_of(view: View, kinds: Sequence[str]) -> Iterator[list[str]]:
    """Yield the cells of each minutia of a view, its kind by the names of `kinds`."""
    m = view.template.minutiae
    degrees = np.degrees(m.angle.astype(np.float64))
    for *place, kind, quality in zip(m.x, m.y, degrees, m.kind, m.quality, strict=True):
        yield [*(f"{float(value):.{DIGITS}g}" for value in place), kinds[kind], str(quality)]


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the template in a file of fpmatch's own format, or raise TemplateError."""
    lines = _text_lines(data)
    frame = _frame(lines[0] if lines else "")
    rows = _rows(lines, ",")
    place, header = next(rows, (f"line {len(lines)}", []))
    if header != COLUMNS:
        raise TemplateError(f"{place}: expected the columns {','.join(COLUMNS)}")
    x, y, degrees, kind, quality = _read_rows(rows, COLUMNS, OWN_NAMES)
    minutiae = Minutiae(x, y, np.radians(degrees), kind, quality)
    return TemplateRecord(CODEC.name, (View(Template(minutiae, **frame)),))


def decode_plain(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a table with a header, or raise TemplateError."""
    lines = _text_lines(data)
    header = _find_header(lines)
    if header is None or "theta" not in header.given:
        raise TemplateError(
            f"line {header.line if header else 1}: expected the columns x, y and one of angles, "
            "theta, angle, direction or orientation"
        )
    name = header.given["theta"]
    match = _ANGLE.fullmatch(name)
    unit = match["unit"] if match else None
    stated = AngleConvention(unit) if unit else OWN_DEGREES if name == "theta" else None
    convention = options.angles or stated
    if convention is None:
        raise TemplateError(f"line {header.line}: columns {', '.join(header.names)}: {UNKNOWN}")
    rows = _rows(lines, header.delimiter, header.line)
    table = _read_rows(rows, header.names, header.given)
    graded = "quality" in header.given
    record = _record(PLAIN_CODEC.name, table, convention, options, graded=graded)
    if options.angles is not None or name == "theta":
        return record
    assumed = f"angles taken for {convention} (--angles sets it)"
    return TemplateRecord(record.format, record.views, (*record.notes, assumed))


def decode_text(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a text of numbers, or raise TemplateError."""
    table, graded = read_numbers(data)
    return _record(TEXT_CODEC.name, table, options.angles, options, graded=graded)


def read_numbers(data: bytes) -> tuple[NDArray[np.float64], bool]:
    """Return the columns x, y, angle, kind and quality of a text, and whether it has the last.

    They have shape (5, N). Raises TemplateError for any other text.
    """
    rows = _rows(_text_lines(data))
    first = next(rows, None)
    if first is None:
        raise TemplateError("no minutiae, only blank lines and comments")
    return _number_columns(chain([first], rows), len(first[1]))


def decode_array(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a `.npy` file, or raise TemplateError."""
    if not is_npy(data):
        raise TemplateError("not a .npy file")
    array = decode_npy(data)
    check_minutiae(len(array))
    rows = ((f"row {number}", row) for number, row in enumerate(array.tolist(), start=1))
    table, graded = _number_columns(rows, array.shape[1])
    return _record(NPY_CODEC.name, table, options.angles, options, graded=graded)


def _number_columns(
    rows: Iterable[tuple[str, list[Any]]], width: int
) -> tuple[NDArray[np.float64], bool]:
    """Return the columns of rows of `width` numbers, as `read_numbers` does."""
    if not 3 <= width <= len(NUMBER_NAMES):
        raise TemplateError(
            f"expected 3 or 4 columns, x, y, angle and perhaps quality, found {width}"
        )
    given = dict(list(NUMBER_NAMES.items())[:width])
    return _read_rows(rows, list(given.values()), given), "quality" in given


def _record(
    name: str,
    table: NDArray[np.float64],
    convention: AngleConvention | None,
    options: ReadingOptions,
    *,
    graded: bool,
) -> TemplateRecord:
    """Return a record of columns x, y, angle, kind and quality without size and resolution."""
    if convention is None:
        raise TemplateError(UNKNOWN)
    x, y, angle, kind, quality = table
    minutiae = x, y, convention.to_radians(angle), kind, quality
    size = options.size or span(x, y)
    view = View.without_frame(minutiae, size, options, quality_known=graded)
    return TemplateRecord(name, (view,), tuple(range_notes(angle, convention)))


def _text_lines(data: bytes) -> list[str]:
    """Return the lines of a file; raises TemplateError unless it is UTF-8 text."""
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise TemplateError(f"not UTF-8 text (byte {error.start})") from error


def _rows(
    lines: list[str], delimiter: str | None = None, start: int = 0
) -> Iterator[tuple[str, list[str]]]:
    """Yield the place and the cells of each line after the first `start`, but of comments.

    They are separated by `delimiter`, or else as numbers may be.
    """
    for number, line in enumerate(lines[start:], start=start + 1):
        text = line.strip()
        if text and not text.startswith("#"):
            place = f"line {number}"
            yield place, _cells(place, line, delimiter) if delimiter else _SEPARATOR.split(text)


def _cells(place: str, line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, stripped."""
    try:
        reader = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
        return [cell.strip() for cell in next(reader)]
    except csv.Error as error:
        raise TemplateError(f"{place}: {error}") from error


def _frame(line: str) -> dict[str, Any]:
    """Return width, height and dpi from the first line, and whether the dpi is known."""
    if line.removeprefix(MAGIC).split()[:1] != [VERSION]:
        raise TemplateError(f"line 1: unknown version of the format (known: {VERSION})")
    values = dict(re.findall(r"(\w+)=([^\s,]+)", line))
    try:
        frame = {"width": int(values["width"]), "height": int(values["height"])}
        known = values.get("dpi_known") != "false"
        return {**frame, "dpi": float(values["dpi"]), "dpi_known": known}
    except (KeyError, ValueError) as error:
        raise TemplateError("line 1: expected width=, height= and dpi= as numbers") from error


def _find_header(lines: list[str]) -> _Header | None:
    """Return the first line not blank as a header with columns x and y; None for others."""
    number = next((k for k, line in enumerate(lines, start=1) if line.strip()), None)
    if number is None or len(lines[number - 1]) > LONGEST_HEADER:
        return None
    line = lines[number - 1].strip().lstrip("# ")
    delimiter = next((sign for sign in ",;\t" if sign in line), " ")
    names = [name.lower() for name in _cells(f"line {number}", line, delimiter)]
    meanings = [
        (column, name)
        for name in names
        for column, known in _NAMES.items()
        if known.fullmatch(name)
    ]
    given = dict(meanings)
    if not {"x", "y"} <= given.keys():
        return None
    if len(set(names)) < len(names) or len(given) < len(meanings):
        raise TemplateError(f"line {number}: a column is there twice: {', '.join(names)}")
    return _Header(number, delimiter, names, given)


def _read_rows(
    rows: Iterable[tuple[str, list[Any]]],
    names: list[str],
    given: Mapping[str, str],
) -> NDArray[np.float64]:
    """Return columns x, y, angle, kind and quality, shape (5, N), of rows with their places.

    `names` are those of all columns in the file, `given` those of the known ones; type and quality
    may be missing.
    """
    table: list[list[float]] = []
    for place, cells in rows:
        check_minutiae(len(table) + 1)
        if len(cells) != len(names):
            raise TemplateError(f"{place}: expected {len(names)} values, found {len(cells)}")
        row = dict(zip(names, cells, strict=True))
        x, y, angle = (_number(row[given[c]], place, given[c]) for c in PLAIN_COLUMNS[:3])
        kind, quality = MinutiaKind.OTHER, 100.0
        if "type" in given:
            word = row[given["type"]]
            try:
                kind = _KINDS[re.sub(r"[ -]", "_", word.lower())]
            except KeyError:
                raise TemplateError(
                    f"{place}: unknown {given['type']} of minutia {word!r} (known: other, ending, "
                    "bifurcation)"
                ) from None
        if "quality" in given:
            quality = _number(row["quality"], place, "quality")
            if not 0 <= quality <= 100:
                raise TemplateError(f"{place}, column quality: {quality:g} is not in 0..100")
        table.append([x, y, angle, kind, quality])
    return np.array(table, dtype=np.float64).reshape(-1, 5).T


def _number(value: Any, place: str, column: str) -> float:
    """Return a finite number that float32 can hold; raises TemplateError that names its place."""
    try:
        number = float(value)
    except ValueError as error:
        shown = repr(value) if value else "nothing"
        raise TemplateError(
            f"{place}, column {column}: expected a number, found {shown}"
        ) from error
    if not abs(number) <= LARGEST:
        raise TemplateError(f"{place}, column {column}: {number:g} is not finite")
    return number


def _recognises(data: bytes) -> bool:
    return data.removeprefix(BYTE_ORDER_MARK).startswith(MAGIC.encode())


def _recognises_plain(data: bytes) -> bool:
    """Return whether the first line has columns x and y and one of angles."""
    first = data.removeprefix(BYTE_ORDER_MARK).lstrip(b"\r\n")[:LONGEST_HEADER]
    try:
        header = _find_header(first.decode("utf-8", "replace").splitlines()[:1])
        return header is not None and "theta" in header.given
    except TemplateError:
        return True  # which then says why


def recognises_text(data: bytes) -> bool:
    """Return whether the first line that is no comment has three or four numbers."""
    comments = _COMMENTS.match(data)
    return _ROW.match(data, comments.end() if comments else 0) is not None


CODEC: Final = Codec("csv", "fpmatch CSV 1", (".csv",), _recognises, decode, encode)
PLAIN_CODEC: Final = Codec(
    "minutiae-csv", "CSV of x, y, theta", (".csv",), _recognises_plain, decode_plain, encode_plain
)
TEXT_CODEC: Final = Codec(
    "numbers", "text of numbers (np.savetxt)", (), recognises_text, decode_text
)
NPY_CODEC: Final = Codec("npy", "NumPy array (np.save)", (), is_npy, decode_array)
