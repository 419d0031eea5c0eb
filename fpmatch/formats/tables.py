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
direction_rad). For another name, `ReadingOptions.angles` must define them. Types are U, E and B, or
other, ending and bifurcation, or 0, 1 and 2, or words of other programs for these, such as
Termination. On reading, type and quality may be missing, the columns may have any order and any of
the names below, and other columns are ignored. Comma, semicolon, tab or spaces separate them, and
the header may begin with #.

Tables without a header are arrays of numpy, as text of `np.savetxt` or as `.npy`. Each row is a
minutia: x, y, its angle, and perhaps its quality. `ReadingOptions.angles` must define how angles
are measured. Numbers of a text are separated by spaces, tabs, commas or semicolons; lines that
begin with # are left out. A file contains neither size, resolution nor kinds.
"""

from __future__ import annotations

import csv
import re
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.base.npy import decode_npy, is_npy
from fpmatch.errors import TemplateError
from fpmatch.formats.angles import OWN_DEGREES, UNKNOWN, AngleConvention, range_notes
from fpmatch.formats.codec import LARGEST, Codec, dropped_notes, side
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
from fpmatch.templates.minutiae import Minutiae, MinutiaKind, Template

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

DIGITS: Final = 9  # significant digits that restore a float32 exactly
MAGIC: Final = "# fpmatch-template"
VERSION: Final = "1"
CONVENTION: Final = (
    "# pixels from the top left, y down; angle_deg counter-clockwise on screen from +x"
)
COLUMNS: Final = ["x", "y", "angle_deg", "kind", "quality"]
KINDS: Final = {kind.name.lower(): kind for kind in MinutiaKind}
BYTE_ORDER_MARK: Final = b"\xef\xbb\xbf"
PLAIN_COLUMNS: Final = ("x", "y", "theta", "type", "quality")
TYPES: Final = {"u": MinutiaKind.OTHER, "e": MinutiaKind.ENDING, "b": MinutiaKind.BIFURCATION}
DELIMITERS: Final = (",", ";", "\t", " ")
HEADER_BYTES: Final = 1000  # of the first line
LONGEST_HEADER: Final = 10_000
_WORDS: Final = {  # of other programs
    MinutiaKind.OTHER: "unknown undefined none crossover crossing trifurcation",
    MinutiaKind.ENDING: "t end term termination terminal rig ridge_ending ridge_end line_ending",
    MinutiaKind.BIFURCATION: "3 bif fork ridge_bifurcation line_bifurcation",  # 3: crossing number
}
_KNOWN_TYPES: Final = {
    **TYPES,
    **KINDS,
    **{str(kind.value): kind for kind in MinutiaKind},
    **{word: kind for kind, words in _WORDS.items() for word in words.split()},
}
_ANGLE: Final = re.compile(
    r"(?P<name>theta|θ|angle|direction|dir|orientation|ori|phi)"
    r"[ _.(\[-]*(?P<unit>deg|rad|°)?(rees?|ians?)?[)\]]?"
)
_UNITS: Final = {"deg": "deg", "°": "deg", "rad": "rad"}
_NAMES: Final = {
    "theta": _ANGLE,
    "x": re.compile(r"x|col|column|(x|pos)_?(px|pos|x|coord)"),
    "y": re.compile(r"y|row|(y|pos)_?(px|pos|y|coord)"),
    "type": re.compile(r"type|kind|minutia_?type"),
    "quality": re.compile(r"quality|qual"),
}
NUMBER_COLUMNS: Final = ("x", "y", "angle", "quality")
FEWEST_NUMBERS: Final = 3
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

    def convention(self) -> AngleConvention | None:
        """Return the convention that the name of the angles implies."""
        match = _ANGLE.fullmatch(self.given["theta"])
        if match and match["unit"]:
            return AngleConvention(_UNITS[match["unit"]])
        return OWN_DEGREES if self.given["theta"] == "theta" else None


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of fpmatch's own format, and notes on what they cannot hold."""
    view = record.single()
    template = view.template
    frame = f"width={template.width} height={template.height} dpi={template.dpi:.17g}"
    frame += " dpi_known=false" * (not template.dpi_known)
    head = [f"{MAGIC} {VERSION} {frame}", CONVENTION, ",".join(COLUMNS)]
    kinds = {kind: name for name, kind in KINDS.items()}
    return _encoded(head, view, kinds, dropped_notes(view, field=True))


def encode_plain(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of the plain format, and notes on what they cannot hold."""
    view = record.single()
    notes = ["size and resolution dropped", *dropped_notes(view, field=True)]
    letters = {kind: letter.upper() for letter, kind in TYPES.items()}
    head = [",".join(PLAIN_COLUMNS if view.quality_known else PLAIN_COLUMNS[:-1])]
    return _encoded(head, view, letters, notes, with_quality=view.quality_known)


def _encoded(
    lines: list[str],
    view: View,
    kinds: Mapping[MinutiaKind, str],
    notes: list[str],
    *,
    with_quality: bool = True,
) -> Encoded:
    """Return the lines of a header, the lines of the minutiae of a view, and notes."""
    m = view.template.minutiae
    degrees = np.degrees(m.angle.astype(np.float64))
    for *place, kind, quality in zip(m.x, m.y, degrees, m.kind, m.quality, strict=True):
        cells = [*(f"{float(value):.{DIGITS}g}" for value in place), kinds[MinutiaKind(kind)]]
        lines.append(",".join([*cells, str(quality)] if with_quality else cells))
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(notes))


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the template in a file of fpmatch's own format, or raise TemplateError."""
    lines = _text_lines(data)
    frame = _frame(lines[0] if lines else "")
    rows = (
        (number, _cells(number, line))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.startswith("#")
    )
    number, header = next(rows, (len(lines), []))
    if header != COLUMNS:
        raise TemplateError(f"line {number}: expected the columns {','.join(COLUMNS)}")
    options.limits.check_size(frame["width"], frame["height"])
    x, y, degrees, kind, quality = _read_table(rows, header, COLUMNS, KINDS, options)
    minutiae = Minutiae(x, y, np.radians(degrees), kind, quality)
    return TemplateRecord(CODEC.name, (View(Template(minutiae, **frame)),))


def decode_plain(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a table with a header, or raise TemplateError."""
    lines = _text_lines(data)
    header = _find_header(lines)
    if header is None:
        raise TemplateError(f"line 1: expected the columns {','.join(PLAIN_COLUMNS)}, each once")
    shown = ", ".join(header.names)
    if "theta" not in header.given:
        raise TemplateError(
            f"line {header.line}: found the columns {shown}; minutiae also need one of angles, "
            "theta, angle, direction or orientation"
        )
    convention = options.angles or header.convention()
    if convention is None:
        raise TemplateError(f"line {header.line}: columns {shown}: {UNKNOWN}")
    rows = (
        (number, _cells(number, line, header.delimiter))
        for number, line in enumerate(lines[header.line :], start=header.line + 1)
        if line.strip() and not line.lstrip().startswith("#")
    )
    columns = [header.given.get(name, name) for name in PLAIN_COLUMNS]
    absent = {columns[3]: "u", columns[4]: "100"}
    table = _read_table(rows, header.names, columns, _KNOWN_TYPES, options, absent)
    notes = range_notes(table[2], convention)
    if options.angles is None and header.given["theta"] != "theta":
        notes.append(f"angles taken for {convention} (--angles sets it)")
    view = _table_view(table, convention, options, quality_known="quality" in header.given)
    return TemplateRecord(PLAIN_CODEC.name, (view,), tuple(notes))


def decode_text(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a text of numbers, or raise TemplateError."""
    table: list[list[float]] = []
    for number, line in enumerate(_text_lines(data), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        options.limits.check_minutiae(len(table) + 1)
        cells = _SEPARATOR.split(line.strip())
        if not FEWEST_NUMBERS <= len(cells) <= len(NUMBER_COLUMNS):
            raise TemplateError(f"line {number}: expected x, y, angle and perhaps quality")
        if table and len(cells) != len(table[0]):
            raise TemplateError(
                f"line {number}: expected {len(table[0])} values, found {len(cells)}"
            )
        named = zip(cells, NUMBER_COLUMNS, strict=False)
        table.append([_parse_number(text, number, column) for text, column in named])
    if not table:
        raise TemplateError("no minutiae, only blank lines and comments")
    return _number_record(np.array(table), TEXT_CODEC.name, options)


def decode_array(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a `.npy` file, or raise TemplateError."""
    if not is_npy(data):
        raise TemplateError("not a .npy file")
    array = decode_npy(data)
    if not FEWEST_NUMBERS <= array.shape[1] <= len(NUMBER_COLUMNS):
        raise TemplateError(
            "expected an array of 3 or 4 columns, x, y, angle and perhaps quality, found "
            f"{array.shape[1]}"
        )
    options.limits.check_minutiae(len(array))
    return _number_record(array, NPY_CODEC.name, options)


def _number_record(
    array: NDArray[np.float64], name: str, options: ReadingOptions
) -> TemplateRecord:
    """Return a record of the minutiae in an array (N, 3) or (N, 4)."""
    if options.angles is None:
        raise TemplateError(UNKNOWN)
    finite = np.abs(array) <= LARGEST
    if not finite.all():
        first, column = np.argwhere(~finite)[0].tolist()
        raise TemplateError(
            f"row {first + 1}, column {NUMBER_COLUMNS[column]}: not a finite number"
        )
    x, y, angle, *qualities = array.T
    quality = qualities[0] if qualities else np.full(len(array), 100.0)
    outside = np.flatnonzero((quality < 0) | (quality > 100))
    if len(outside):
        value = quality[outside[0]]
        raise TemplateError(f"row {outside[0] + 1}, column quality: {value:g} is not in 0..100")
    table = x, y, angle, np.zeros(len(array)), quality  # of kind other
    view = _table_view(table, options.angles, options, quality_known=bool(qualities))
    return TemplateRecord(name, (view,), tuple(range_notes(angle, options.angles)))


def _table_view(
    table: Any, convention: AngleConvention, options: ReadingOptions, *, quality_known: bool
) -> View:
    """Return the print of columns x, y, angle, kind and quality without size and resolution."""
    x, y, angle, kind, quality = table
    minutiae = x, y, convention.to_radians(angle), kind, quality
    size = options.size or (side(x), side(y))
    return View.without_frame(minutiae, size, options, quality_known=quality_known)


def _text_lines(data: bytes) -> list[str]:
    """Return the lines of a file; raises TemplateError unless it is UTF-8 text."""
    try:
        return data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise TemplateError(f"not UTF-8 text (byte {error.start})") from error


def _cells(number: int, line: str, delimiter: str = ",") -> list[str]:
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
    for delimiter in DELIMITERS:
        names = [name.lower() for name in _cells(number, line, delimiter)]
        while names and not names[-1]:
            names.pop()
        meanings = [(_meaning(name), name) for name in names]
        known = [meaning for meaning, _ in meanings if meaning]
        if {"x", "y"} <= set(known):
            if len(set(names)) < len(names) or len(set(known)) < len(known):
                raise TemplateError(f"line {number}: a column is there twice: {', '.join(names)}")
            return _Header(number, delimiter, names, dict(pair for pair in meanings if pair[0]))
    return None


def _meaning(name: str) -> str:
    """Return which of the five columns a name means, or nothing."""
    return next((column for column, names in _NAMES.items() if names.fullmatch(name)), "")


def _read_table(
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
            _parse_number(row[name], number, name) for name in (*columns[:3], columns[4])
        )
        if not 0 <= quality <= 100:
            raise TemplateError(f"line {number}, column {columns[4]}: {quality:g} is not in 0..100")
        table.append([x, y, angle, kinds[word], quality])
    return np.array(table, dtype=np.float64).reshape(-1, len(columns)).T


def _parse_number(text: str, line: int, column: str) -> float:
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


def _recognises(data: bytes) -> bool:
    return data.removeprefix(BYTE_ORDER_MARK).startswith(MAGIC.encode())


def _recognises_plain(data: bytes) -> bool:
    """Return whether the first line has columns x and y and one of angles."""
    first = data.removeprefix(BYTE_ORDER_MARK).lstrip(b"\r\n")[:HEADER_BYTES]
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
