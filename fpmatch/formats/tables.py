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
from fpmatch.templates.minutiae import COLUMNS, LARGEST, Minutiae, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

DIGITS: Final = 9  # significant digits that restore a float32 exactly
MAGIC: Final = "# fpmatch-template"
VERSION: Final = "1"
CONVENTION: Final = (
    "# pixels from the top left, y down; angle_deg counter-clockwise on screen from +x"
)
OWN_HEADER: Final = ["x", "y", "angle_deg", "kind", "quality"]
PLAIN_HEADER: Final = ["x", "y", "theta", "type", "quality"]
NUMBERS: Final = ["x", "y", "angle", "quality"]
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
    "angle": _ANGLE,
    "x": re.compile("x"),
    "y": re.compile("y"),
    "kind": re.compile("type|kind"),
    "quality": re.compile("quality"),
}
_NUMBER: Final = rb"[-+]?(\d{1,40}\.?\d{0,40}|\.\d{1,40})([eE][-+]?\d{1,3})?"
_BETWEEN: Final = rb"([ \t]*[,;\t ][ \t]*)"
_ROW: Final = re.compile(rb"[ \t]*%b(%b%b){2,3}[ \t]*\r?(\n|$)" % (_NUMBER, _BETWEEN, _NUMBER))
_SEPARATOR: Final = re.compile(r"\s*[,;]\s*|\s+")
_COMMENTS: Final = re.compile(rb"([ \t]*(#[^\n]*)?\r?\n)*")


class _Header(NamedTuple):
    """The names of a header: known columns are named as in `Minutiae`, others as they are."""

    line: int
    delimiter: str
    names: list[str]
    angle: str  # the name of the column of angles as the file has it, in lower case


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of fpmatch's own format, and notes on what they cannot hold."""
    view = record.single()
    template = view.template
    frame = f"width={template.width} height={template.height} dpi={template.dpi:.17g}"
    frame += " dpi_known=false" * (not template.dpi_known)
    head = [f"{MAGIC} {VERSION} {frame}", CONVENTION, ",".join(OWN_HEADER)]
    lines = [",".join(row) for row in _cells_of(view, ("other", "ending", "bifurcation"))]
    text = "\n".join([*head, *lines, ""])
    return Encoded(text.encode(), tuple(dropped_notes(record, field=True)))


def encode_plain(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of the plain format, and notes on what they cannot hold."""
    view = record.single()
    width = len(PLAIN_HEADER) - (not view.quality_known)
    rows = [PLAIN_HEADER, *_cells_of(view, "UEB")]
    text = "".join(",".join(row[:width]) + "\n" for row in rows)
    notes = ["size and resolution dropped", *dropped_notes(record, field=True)]
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
    if header != OWN_HEADER:
        raise TemplateError(f"{place}: expected the columns {','.join(OWN_HEADER)}")
    x, y, degrees, kind, quality = _read_rows(rows, COLUMNS)
    minutiae = Minutiae(x, y, np.radians(degrees), kind, quality)
    return TemplateRecord(CODEC.name, (View(Template(minutiae, **frame)),))


def decode_plain(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a table with a header, or raise TemplateError."""
    lines = _text_lines(data)
    header = _find_header(lines)
    if header is None:
        raise TemplateError(
            "line 1: expected the columns x, y and one of angles, theta, angle, direction or "
            "orientation"
        )
    match = _ANGLE.fullmatch(header.angle)
    unit = match["unit"] if match else None
    stated = AngleConvention(unit) if unit else OWN_DEGREES if header.angle == "theta" else None
    convention = options.angles or stated
    if convention is None:
        raise TemplateError(f"line {header.line}, column {header.angle}: {UNKNOWN}")
    table = _read_rows(_rows(lines, header.delimiter, header.line), header.names)
    view = _view(table, convention, options, graded="quality" in header.names)
    notes = range_notes(table[2], convention)
    if options.angles is None and unit:
        notes.append(f"angles taken for {unit}, counter-clockwise on screen (--angles sets it)")
    return TemplateRecord(PLAIN_CODEC.name, (view,), tuple(notes))


def decode_text(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a text of numbers, or raise TemplateError."""
    table, graded = read_numbers(data)
    return _number_record(TEXT_CODEC.name, table, options, graded=graded)


def read_numbers(data: bytes) -> tuple[NDArray[np.float64], bool]:
    """Return the columns x, y, angle, kind and quality of a text, and whether it has the last.

    They have shape (5, N). Raises TemplateError for any other text.
    """
    rows = _rows(_text_lines(data))
    first = next(rows, None)
    if first is None:
        raise TemplateError("no minutiae, only blank lines and comments")
    width = len(first[1])
    return _read_rows(chain([first], rows), _number_names(width)), width == len(NUMBERS)


def decode_array(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a `.npy` file, or raise TemplateError."""
    if not is_npy(data):
        raise TemplateError("not a .npy file")
    array = decode_npy(data)
    check_minutiae(len(array))
    rows = ((f"row {number}", row) for number, row in enumerate(array.tolist(), start=1))
    names = _number_names(array.shape[1])
    table = _read_rows(rows, names)
    return _number_record(NPY_CODEC.name, table, options, graded=names == NUMBERS)


def _number_names(width: int) -> list[str]:
    """Return the names of so many columns of bare numbers."""
    if not 3 <= width <= len(NUMBERS):
        raise TemplateError(
            f"expected 3 or 4 columns, x, y, angle and perhaps quality, found {width}"
        )
    return NUMBERS[:width]


def _number_record(
    name: str, table: NDArray[np.float64], options: ReadingOptions, *, graded: bool
) -> TemplateRecord:
    """Return a record of columns of bare numbers, as `read_numbers` returns them."""
    if options.angles is None:
        raise TemplateError(UNKNOWN)
    view = _view(table, options.angles, options, graded=graded)
    return TemplateRecord(name, (view,), tuple(range_notes(table[2], options.angles)))


def _view(
    table: NDArray[np.float64], angles: AngleConvention, options: ReadingOptions, *, graded: bool
) -> View:
    """Return a print of columns x, y, angle, kind and quality without size and resolution."""
    x, y, angle, kind, quality = table
    minutiae = x, y, angles.to_radians(angle), kind, quality
    return View.without_frame(minutiae, options.size or span(x, y), options, quality_known=graded)


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
    """Return the first line not blank as a header of minutiae; None for others."""
    number = next((k for k, line in enumerate(lines, start=1) if line.strip()), None)
    if number is None or len(lines[number - 1]) > LONGEST_HEADER:
        return None
    line = lines[number - 1].strip().lstrip("# ")
    delimiter = next((sign for sign in ",;\t" if sign in line), " ")
    given = [name.lower() for name in _cells(f"line {number}", line, delimiter)]
    names = [next((c for c, known in _NAMES.items() if known.fullmatch(n)), n) for n in given]
    if not {"x", "y", "angle"} <= set(names):
        return None
    if len(set(names)) < len(names):
        raise TemplateError(f"line {number}: a column is there twice: {', '.join(given)}")
    return _Header(number, delimiter, names, given[names.index("angle")])


def _read_rows(rows: Iterable[tuple[str, list[Any]]], names: Sequence[str]) -> NDArray[np.float64]:
    """Return columns x, y, angle, kind and quality, shape (5, N), of rows with their places.

    `names` has the name of each column; kind and quality may be missing.
    """
    table: list[list[float]] = []
    for place, cells in rows:
        check_minutiae(len(table) + 1)
        if len(cells) != len(names):
            raise TemplateError(f"{place}: expected {len(names)} values, found {len(cells)}")
        row: dict[str, Any] = {"kind": "other", "quality": 100.0}
        row |= dict(zip(names, cells, strict=True))
        kind = _KINDS.get(re.sub(r"[ -]", "_", row["kind"].lower()))
        if kind is None:
            raise TemplateError(
                f"{place}: unknown kind of minutia {row['kind']!r} (known: other, ending, "
                "bifurcation)"
            )
        x, y, angle, quality = (_number(row[name], place, name) for name in NUMBERS)
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
        return _find_header(first.decode("utf-8", "replace").splitlines()[:1]) is not None
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
