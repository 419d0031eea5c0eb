"""MIN files of NIST's minutiae detector, mindtct.

A file looks like this::

    Image (w,h) 300 300

    20 Minutiae Detected

       0 :   22,  284 : 31 :  0.162 :BIF : DIS :  2 :   23, 273;  0 :   40, 134;  7

that is: number; x and y in pixels from the top left; direction in 32 steps, clockwise from
straight up; reliability, 0 to 1; ridge ending or bifurcation; whether the ridge appears or
disappears there; the pixel pattern of the detection; neighbours with ridge counts.

The last three are ignored, and written as ``APP``, 0 and no neighbours. Other kinds are written as
ridge endings. A file contains no resolution.
"""

from __future__ import annotations

import re
from typing import Any, Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import (
    Codec,
    dropped_notes,
    fit_minutiae,
    whole_pixels,
)
from fpmatch.formats.record import Encoded, ReadingOptions, TemplateRecord, View
from fpmatch.templates.minutiae import Minutiae, MinutiaKind, Template

MOST_MINUTIAE: Final = 9999  # largest number of four digits
STEPS: Final = 32  # of a turn
STRAIGHT_UP: Final = STEPS // 4  # in steps counter-clockwise from +x
KINDS: Final = {"RIG": MinutiaKind.ENDING, "BIF": MinutiaKind.BIFURCATION}
_HEAD: Final = re.compile(rb"\s*Image \(w,h\) (\d{1,6}) (\d{1,6})\s")
_ROW: Final = re.compile(
    r"\s*\d+ *: *(-?\d{1,6}), *(-?\d{1,6}) *: *(\d{1,2}) *: *(\d{1,3}\.\d{1,9}) *: *(RIG|BIF) *:.*"
)
_COUNT: Final = re.compile(r"\s*(\d{1,9}) Minutiae Detected\s*")


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the print in a file, or raise TemplateError."""
    head = _HEAD.match(data)
    if head is None:
        raise TemplateError("line 1: expected Image (w,h) and two numbers")
    size = int(head[1]), int(head[2])
    options.limits.check_size(*size)
    try:
        text = data.decode("ascii")
    except UnicodeDecodeError as error:
        raise TemplateError(f"not ASCII text (byte {error.start})") from error
    lines = (line for line in enumerate(text.split("\n"), start=1) if line[1].strip())
    next(lines)  # the size
    declared = _COUNT.fullmatch(next(lines, (0, ""))[1])
    if declared is None:
        raise TemplateError("expected the number of minutiae after the size")
    options.limits.check_minutiae(int(declared[1]))
    rows: list[list[float]] = []
    for line in lines:
        options.limits.check_minutiae(len(rows) + 1)
        rows.append(_minutia(*line))
    if len(rows) != int(declared[1]):
        raise TemplateError(f"declares {int(declared[1])} minutiae and has {len(rows)}")
    table: Any = np.array(rows, dtype=np.float64).reshape(-1, 5)
    x, y, step, reliability, kind = table.T
    angle = np.mod(STRAIGHT_UP - step, STEPS) * (2 * np.pi / STEPS)
    minutiae = Minutiae(x, y, angle, kind, np.clip(reliability * 100.0, 0, 100))
    template = Template(minutiae, *size, options.assumed_dpi, dpi_known=False)
    return TemplateRecord(CODEC.name, (View(template),))


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and notes on what they cannot hold."""
    view = record.single()
    template, notes = view.template, ["resolution dropped, angles in steps of 11.25°"]
    minutiae = fit_minutiae(template, MOST_MINUTIAE, notes)
    notes += dropped_notes(view)
    x, y = whole_pixels(minutiae.x, template.width), whole_pixels(minutiae.y, template.height)
    turn = np.rint(minutiae.angle.astype(np.float64) * (STEPS / (2 * np.pi)))
    step = np.mod(STRAIGHT_UP - turn, STEPS).astype(np.int64)
    lines = [f"Image (w,h) {template.width} {template.height}", ""]
    lines += [f"{len(minutiae)} Minutiae Detected", ""]
    for k in range(len(minutiae)):
        kind = "BIF" if minutiae.kind[k] == MinutiaKind.BIFURCATION else "RIG"
        place = f"{x[k]:4d}, {y[k]:4d} : {step[k]:2d} : {int(minutiae.quality[k]) / 100:6.3f}"
        lines.append(f"{k:4d} : {place} :{kind} : APP :  0 ")
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(notes))


def _minutia(number: int, line: str) -> list[float]:
    """Return x, y, direction, reliability and kind of one line."""
    row = _ROW.fullmatch(line.rstrip("\r"))
    if row is None:
        raise TemplateError(f"line {number}: not a minutia as mindtct writes them")
    if int(row[3]) >= STEPS:
        raise TemplateError(f"line {number}: a direction of {row[3]}, where 31 is the last")
    return [*map(float, row.groups()[:4]), KINDS[row[5]]]


def _recognises(data: bytes) -> bool:
    return data.lstrip().startswith(b"Image (w,h) ")


CODEC: Final = Codec("min", "NIST MIN (mindtct)", (".min",), _recognises, decode, encode)
