"""Templates as lines of tab-separated numbers, after a line with the frame.

A file looks like this::

    #tab    388 374 500
    101     57.5    278.4   1   90

The frame is width, height and dpi; a minutia is x, y, direction in degrees, kind and quality.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fpmatch.errors import TemplateError
from fpmatch.formats.record import (
    Codec,
    Encoded,
    ReadingOptions,
    TemplateRecord,
    View,
    check_minutiae,
)
from fpmatch.templates.minutiae import Minutiae, Template

MAGIC: Final = "#tab\t"


def encode(record: TemplateRecord) -> Encoded:
    """Return a record as bytes, and messages about what the format cannot hold."""
    template = record.single().template  # raises for a record of several prints
    m = template.minutiae
    lines = [f"{MAGIC}{template.width}\t{template.height}\t{template.dpi:.17g}"]
    for row in zip(m.x, m.y, np.degrees(m.angle.astype(float)), m.kind, m.quality, strict=True):
        lines.append("\t".join(f"{float(value):.9g}" for value in row))
    lost = [] if template.field is None else ["the ridge field dropped"]
    return Encoded(("\n".join(lines) + "\n").encode(), tuple(lost))


def decode(data: bytes, options: ReadingOptions) -> TemplateRecord:
    """Return the record in the bytes; errors name the line, and the caller adds the file."""
    try:
        head, *lines = data.decode().splitlines()
        width, height, dpi = head.removeprefix(MAGIC).split("\t")
        frame = int(width), int(height), float(dpi)
    except ValueError as error:
        raise TemplateError("line 1: expected #tab, width, height and dpi") from error
    check_minutiae(len(lines))
    rows = np.empty((len(lines), 5))
    for number, line in enumerate(lines):
        try:
            rows[number] = [float(value) for value in line.split("\t")]
        except ValueError as error:
            raise TemplateError(f"line {number + 2}: expected five numbers") from error
    x, y, degrees, kind, quality = rows.T
    minutiae = Minutiae(x, y, np.radians(degrees), kind, quality)  # validates
    return TemplateRecord(CODEC.name, (View(Template(minutiae, *frame)),))


def recognises(data: bytes) -> bool:
    """Return whether the first bytes are those of this format."""
    return data.startswith(MAGIC.encode())


CODEC: Final = Codec("tab", "Tab-separated minutiae", (".tab",), recognises, decode, encode)
