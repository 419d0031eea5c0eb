"""XYT files of NIST's minutiae detector and matcher, mindtct and bozorth3.

A line for each minutia: x, y, angle and, where the file has it, quality, all whole numbers, with
spaces between. A file contains neither size nor resolution nor kinds. There are two conventions,
and a file does not name its own:

- ``xyt``, NIST's own, the default of `mindtct`: origin at the bottom left, y
  up; degrees counter-clockwise from +x, in the direction opposite to that of ISO/IEC 19794-2;
- ``xyt-m1``, that of ANSI/INCITS 378, ``mindtct -m1``: origin at the top left, y down; the
  direction of ISO/IEC 19794-2 in units of two degrees, 0 to 179.

By content, a file without an angle above 179 is assigned to the second, any other to the first; a
print with n minutiae in NIST's convention has no angle above 179 with probability about 2⁻ⁿ. The
record's note names the choice.
"""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.record import (
    Codec,
    Encoded,
    ReadingOptions,
    TemplateRecord,
    View,
    dropped_notes,
    fit_minutiae,
    span,
    whole_steps,
)
from fpmatch.formats.tables import read_numbers

if TYPE_CHECKING:
    from collections.abc import Callable

MOST_MINUTIAE: Final = 1000  # that bozorth3 reads
FULL_TURN: Final = 360
M1_STEPS: Final = 180
_ROW: Final = re.compile(rb"[ \t]*-?\d{1,5}([ \t]+-?\d{1,5}){2,3}[ \t]*\r?(\n|$)")


def decode(data: bytes, options: ReadingOptions, *, m1: bool) -> TemplateRecord:
    """Return the print in a file of either convention, or raise TemplateError."""
    columns, graded = read_numbers(data)
    x, y, angle, kind, quality = columns
    if (columns % 1).any():
        raise TemplateError("expected whole numbers x, y, angle and perhaps quality")
    if (np.abs(angle) > FULL_TURN).any():
        raise TemplateError(f"an angle of {angle[np.abs(angle).argmax()]:g}")
    width, height = options.size or span(x, y if m1 else y - 1)
    degrees = angle * 2 if m1 else angle + FULL_TURN // 2
    minutiae = x, y if m1 else height - y, np.radians(degrees), kind, quality
    view = View.without_frame(minutiae, (width, height), options, quality_known=graded)
    convention = "ANSI/INCITS 378: y down, units of 2°" if m1 else "NIST: y up, degrees"
    return TemplateRecord("xyt-m1" if m1 else "xyt", (view,), (f"angles taken for {convention}",))


def encode(record: TemplateRecord, *, m1: bool) -> Encoded:
    """Return a record as bytes of either convention, and notes on what they cannot hold."""
    view = record.single()
    template, notes = view.template, list[str]()
    minutiae = fit_minutiae(template, MOST_MINUTIAE, notes)
    if not len(minutiae):
        raise TemplateError("a print without minutiae would be an empty file of this format")
    x, y = np.rint(minutiae.xy.astype(np.float64)).astype(np.int64).T
    if m1:
        angle = whole_steps(minutiae.angle, M1_STEPS)
    else:
        y = template.height - y
        angle = (whole_steps(minutiae.angle, FULL_TURN) + FULL_TURN // 2) % FULL_TURN
    quality = [minutiae.quality.astype(np.int64)] if view.quality_known else []
    notes += ["kinds, size and resolution dropped", *dropped_notes(record)]
    rows = np.column_stack([x, y, angle, *quality]).tolist()
    return Encoded("".join(" ".join(map(str, row)) + "\n" for row in rows).encode(), tuple(notes))


def _recognises(data: bytes) -> bool:
    return _ROW.match(data.lstrip(b"\r\n")) is not None


def _recognises_m1(data: bytes) -> bool:
    """Return whether `data` are rows without an angle that only NIST's convention has."""
    rows = (row.split() for row in data.split(b"\n") if _ROW.fullmatch(row))
    return _recognises(data) and all(0 <= int(row[2]) < M1_STEPS for row in rows)


def _codec(name: str, title: str, recognises: Callable[[bytes], bool], *, m1: bool) -> Codec:
    return Codec(
        name, title, (f".{name}",), recognises, partial(decode, m1=m1), partial(encode, m1=m1)
    )


M1_CODEC: Final = _codec("xyt-m1", "NIST XYT, angles of ANSI/INCITS 378", _recognises_m1, m1=True)
CODEC: Final = _codec("xyt", "NIST XYT", _recognises, m1=False)
