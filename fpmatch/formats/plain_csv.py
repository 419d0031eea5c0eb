"""Tables of minutiae with a header, as other programs write them.

fpmatch writes them like this::

    x,y,theta,type,quality
    101,57.5,278.4,E,90

Positions are pixels from the top left, y down. Angles in a column theta are degrees in fpmatch's
own convention (ISO/IEC 19794-2), and so are angles in a column whose name contains the unit
(angle_deg, direction_rad). For another name, `ReadingOptions.angles` must define them. Types are U,
E and B, or other, ending and bifurcation, or 0, 1 and 2, or words of other programs for these, such
as Termination; quality runs from 0 to 100.

On reading, type and quality may be missing, the columns may have any order and any of the names
below, and other columns are ignored. Comma, semicolon, tab or spaces separate them, and the header
may begin with #. A file contains neither size nor resolution.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from fpmatch.errors import TemplateError
from fpmatch.formats.angles import OWN_DEGREES, UNKNOWN, AngleConvention, range_notes
from fpmatch.formats.codec import Codec, dropped_notes, side
from fpmatch.formats.csv_format import (
    BYTE_ORDER_MARK,
    KINDS,
    cells_of,
    places_of,
    read_table,
    text_lines,
)
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
from fpmatch.templates.minutiae import MinutiaKind

COLUMNS: Final = ("x", "y", "theta", "type", "quality")
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
_NAMES: Final = {
    "x": re.compile(r"x|col|column|(x|pos)_?(px|pos|x|coord)"),
    "y": re.compile(r"y|row|(y|pos)_?(px|pos|y|coord)"),
    "type": re.compile(r"type|kind|minutia_?type"),
    "quality": re.compile(r"quality|qual"),
}
_ANGLE: Final = re.compile(
    r"(?P<name>theta|θ|angle|direction|dir|orientation|ori|phi)"
    r"[ _.(\[-]*(?P<unit>deg|rad|°)?(rees?|ians?)?[)\]]?"
)
_UNITS: Final = {"deg": "deg", "°": "deg", "rad": "rad"}


class _Header(NamedTuple):
    """Names of a header as the file has them, in lower case, and what the known columns mean."""

    line: int
    delimiter: str
    names: list[str]
    given: dict[str, str]  # the name that the file gives to column x, y, theta, type, quality

    def convention(self) -> AngleConvention | None:
        """Return the convention that the name of the angles implies."""
        match = _ANGLE.fullmatch(self.given["theta"])
        unit = match["unit"] if match else None
        if unit is not None:
            return AngleConvention(_UNITS[unit])
        return OWN_DEGREES if self.given["theta"] == "theta" else None


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes of the plain format, and notes on what they cannot hold."""
    view = record.single()
    m = view.template.minutiae
    notes = ["size and resolution dropped", *dropped_notes(view, field=True)]
    letters = {kind: letter.upper() for letter, kind in TYPES.items()}
    lines = [",".join(COLUMNS if view.quality_known else COLUMNS[:-1])]
    for place, kind, quality in zip(places_of(m), m.kind, m.quality, strict=True):
        cells = [place, letters[MinutiaKind(kind)]]
        lines.append(",".join([*cells, str(quality)] if view.quality_known else cells))
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(notes))


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a table with a header, or raise TemplateError."""
    lines = text_lines(data)
    header = _find_header(lines)
    if header is None:
        raise TemplateError(f"line 1: expected the columns {','.join(COLUMNS)}, each once")
    shown = ", ".join(header.names)
    if "theta" not in header.given:
        raise TemplateError(
            f"line {header.line}: found the columns {shown}; minutiae also need one of angles, "
            "theta, angle, direction or orientation"
        )
    stated = header.convention()
    convention = options.angles or stated
    if convention is None:
        raise TemplateError(f"line {header.line}: columns {shown}: {UNKNOWN}")
    rows = (
        (number, cells_of(number, line, header.delimiter))
        for number, line in enumerate(lines[header.line :], start=header.line + 1)
        if line.strip() and not line.lstrip().startswith("#")
    )
    columns = [header.given.get(name, name) for name in COLUMNS]
    absent = {columns[3]: "u", columns[4]: "100"}
    x, y, angle, kind, quality = read_table(
        rows, header.names, columns, _KNOWN_TYPES, options, absent
    )
    minutiae = x, y, convention.to_radians(angle), kind, quality
    known, size = "quality" in header.given, options.size or (side(x), side(y))
    view = View.without_frame(minutiae, size, options, quality_known=known)
    notes = range_notes(angle, convention)
    if options.angles is None and header.given["theta"] != "theta":
        notes.append(f"angles taken for {convention} (--angles sets it)")
    return TemplateRecord(CODEC.name, (view,), tuple(notes))


def _find_header(lines: list[str]) -> _Header | None:
    """Return the first line not blank as a header with columns x and y; None for others."""
    number = next((k for k, line in enumerate(lines, start=1) if line.strip()), None)
    if number is None or len(lines[number - 1]) > LONGEST_HEADER:
        return None
    line = lines[number - 1].strip().lstrip("# ")
    for delimiter in DELIMITERS:
        names = [name.lower() for name in cells_of(number, line, delimiter)]
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
    if _ANGLE.fullmatch(name):
        return "theta"
    return next((column for column, names in _NAMES.items() if names.fullmatch(name)), "")


def _recognises(data: bytes) -> bool:
    """Return whether the first line has columns x and y and one of angles."""
    first = data.removeprefix(BYTE_ORDER_MARK).lstrip(b"\r\n")[:HEADER_BYTES]
    try:
        header = _find_header(first.decode("utf-8", "replace").splitlines()[:1])
        return header is not None and "theta" in header.given
    except TemplateError:
        return True  # which then says why


CODEC: Final = Codec("minutiae-csv", "CSV of x, y, theta", (".csv",), _recognises, decode, encode)
