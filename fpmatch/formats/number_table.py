"""Tables of minutiae without a header: arrays of numpy, as text of `np.savetxt` or as `.npy`.

Each row is a minutia: x and y in pixels from the top left, y down, its angle, and perhaps its
quality, 0 to 100. `ReadingOptions.angles` must define how angles are measured. Numbers of a text
are separated by spaces, tabs, commas or semicolons; lines that begin with # are left out. A file
contains neither size, resolution nor kinds.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.npy import decode_npy, is_npy
from fpmatch.errors import TemplateError
from fpmatch.formats.angles import UNKNOWN, range_notes
from fpmatch.formats.codec import LARGEST, Codec
from fpmatch.formats.csv_format import parse_number, table_view, text_lines
from fpmatch.formats.record import ReadingOptions, TemplateRecord

if TYPE_CHECKING:
    from numpy.typing import NDArray

COLUMNS: Final = ("x", "y", "angle", "quality")
FEWEST_COLUMNS: Final = 3
_NUMBER: Final = rb"[-+]?(\d{1,40}\.?\d{0,40}|\.\d{1,40})([eE][-+]?\d{1,3})?"
_BETWEEN: Final = rb"([ \t]*[,;\t ][ \t]*)"
_ROW: Final = re.compile(rb"[ \t]*%b(%b%b){2,3}[ \t]*\r?(\n|$)" % (_NUMBER, _BETWEEN, _NUMBER))
_SEPARATOR: Final = re.compile(r"\s*[,;]\s*|\s+")
_COMMENTS: Final = re.compile(rb"([ \t]*(#[^\n]*)?\r?\n)*")


def decode_text(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a text of numbers, or raise TemplateError."""
    table: list[list[float]] = []
    for number, line in enumerate(text_lines(data), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        options.limits.check_minutiae(len(table) + 1)
        cells = _SEPARATOR.split(line.strip())
        if not FEWEST_COLUMNS <= len(cells) <= len(COLUMNS):
            raise TemplateError(f"line {number}: expected x, y, angle and perhaps quality")
        if table and len(cells) != len(table[0]):
            raise TemplateError(
                f"line {number}: expected {len(table[0])} values, found {len(cells)}"
            )
        named = zip(cells, COLUMNS, strict=False)
        table.append([parse_number(text, number, column) for text, column in named])
    if not table:
        raise TemplateError("no minutiae, only blank lines and comments")
    return _record(np.array(table), TEXT_CODEC.name, options)


def decode_array(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the minutiae in a `.npy` file, or raise TemplateError."""
    if not is_npy(data):
        raise TemplateError("not a .npy file")
    array = decode_npy(data)
    if not FEWEST_COLUMNS <= array.shape[1] <= len(COLUMNS):
        raise TemplateError(
            "expected an array of 3 or 4 columns, x, y, angle and perhaps quality, found "
            f"{array.shape[1]}"
        )
    options.limits.check_minutiae(len(array))
    return _record(array, NPY_CODEC.name, options)


def _record(array: NDArray[np.float64], name: str, options: ReadingOptions) -> TemplateRecord:
    """Return a record of the minutiae in an array (N, 3) or (N, 4)."""
    if options.angles is None:
        raise TemplateError(UNKNOWN)
    finite = np.abs(array) <= LARGEST
    if not finite.all():
        first, column = np.argwhere(~finite)[0].tolist()
        raise TemplateError(f"row {first + 1}, column {COLUMNS[column]}: not a finite number")
    x, y, angle, *qualities = array.T
    quality = qualities[0] if qualities else np.full(len(array), 100.0)
    outside = np.flatnonzero((quality < 0) | (quality > 100))
    if len(outside):
        value = quality[outside[0]]
        raise TemplateError(f"row {outside[0] + 1}, column quality: {value:g} is not in 0..100")
    table = x, y, angle, np.zeros(len(array)), quality  # of kind other
    view = table_view(table, options.angles, options, quality_known=bool(qualities))
    return TemplateRecord(name, (view,), tuple(range_notes(angle, options.angles)))


def recognises_text(data: bytes) -> bool:
    """Return whether the first line that is no comment has three or four numbers."""
    comments = _COMMENTS.match(data)
    return _ROW.match(data, comments.end() if comments else 0) is not None


TEXT_CODEC: Final = Codec(
    "numbers", "text of numbers (np.savetxt)", (), recognises_text, decode_text
)
NPY_CODEC: Final = Codec("npy", "NumPy array (np.save)", (), is_npy, decode_array)
