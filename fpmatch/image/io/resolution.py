"""Find the resolution of an image file in its tags and comments."""

from __future__ import annotations

import re
import struct
from typing import TYPE_CHECKING, Any, Final

from fpmatch.templates.minutiae import (
    CM_PER_INCH,
    MAX_DPI,
    MIN_DPI,
    dpi_of_per_cm,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from PIL import Image

_X_RESOLUTION, _Y_RESOLUTION, _UNIT, _DESCRIPTION = 282, 283, 296, 270  # TIFF's tags, and Exif's
_NO_UNIT, _PER_CM = 1, 3
_RECORD_PER_INCH, _RECORD_PER_CM = 1, 2
_EQUAL: Final = 0.01  # relative difference of two axes of one resolution
_COMMENT_BYTES: Final = 4096  # searched in a header and in each comment
_IN_A_COMMENT: Final = re.compile(
    r"\b(?:ppi|dpi)\b[^\w\n]{0,3}(\d{3,4}(?:\.\d+)?)\b|\b(\d{3,4}(?:\.\d+)?) ?(?:ppi|dpi)\b",
    re.IGNORECASE | re.ASCII,
)
_PNM_COMMENT: Final = re.compile(rb"#[^\r\n]*")
# What Pillow raises for a damaged tag.
UNREADABLE: Final = (
    *(ArithmeticError, AttributeError, LookupError, OSError, SyntaxError, TypeError, ValueError),
    struct.error,
)

ASSUMED_UNIT: Final = "its resolution has no unit; dots per inch assumed"


def usable_dpi(value: object) -> float | None:
    """Return the resolution of both axes in dpi; see `usable_axes`."""
    axes = usable_axes(value, value)
    return axes and axes[0]


def usable_axes(horizontal: object, vertical: object) -> tuple[float, float] | None:
    """Return a file's resolution across and down in dpi, rounded to a tenth, or None.

    Axes that differ by 1 % or less have the horizontal one. None where a value is not above 100 and
    up to 4000 dpi: lower ones (1, 72, 96) are defaults of programs.

    Examples
    --------
    >>> usable_axes(569, 570), usable_axes(500, 357), usable_axes(72, 500)
    ((569.0, 569.0), (500.0, 357.0), None)
    """
    across, down = _rounded(horizontal), _rounded(vertical)
    if across is None or down is None or not all(MIN_DPI < d <= MAX_DPI for d in (across, down)):
        return None
    equal = abs(across - down) <= _EQUAL * max(across, down)
    return across, across if equal else down


def dpi_in_units(units: int, pixels: float) -> float | None:
    """Return the resolution of a record in dpi, of a code of the units and whole pixels a unit.

    The code is that of ANSI/NIST-ITL and ISO/IEC 19794-4: 1 for pixels per inch, 2 per centimetre.
    """
    if units == _RECORD_PER_INCH:
        return usable_dpi(pixels)
    if units != _RECORD_PER_CM:
        return None
    return usable_dpi(dpi_of_per_cm(pixels))


def tagged_axes(
    image: Image.Image, head: bytes
) -> tuple[tuple[float, float] | None, tuple[str, ...]]:
    """Return the resolution of an opened image file, and a note where it is doubtful.

    It is taken across and down from the format's own tag, else from Exif, else from a comment such
    as NIST's ``PPI 500``; `head` is the beginning of the file.
    """
    for unit, horizontal, vertical in _pairs(image):
        axes = usable_axes(horizontal, vertical)
        if axes is not None:
            return axes, (ASSUMED_UNIT,) if unit == _NO_UNIT else ()
    matches = (_IN_A_COMMENT.search(comment[:_COMMENT_BYTES]) for comment in _comments(image, head))
    dpis = (match[1] or match[2] for match in matches if match)
    return next((axes for dpi in dpis if (axes := usable_axes(dpi, dpi))), None), ()


def _rounded(value: object) -> float | None:
    try:
        return round(float(value), 1)  # type: ignore[arg-type]  # 500 dpi per metre are 499.999
    except UNREADABLE:
        return None


def _pairs(image: Image.Image) -> Iterator[tuple[int, Any, Any]]:
    """Yield the unit (1 for none) and both resolutions of every tag that has them, per inch."""
    for unit, key in ((0, "dpi"), (_NO_UNIT, "resolution")):
        pair = image.info.get(key)
        if isinstance(pair, tuple) and len(pair) == 2:
            yield unit, *pair
    try:
        exif = image.getexif()
        across, down, scale = (exif.get(tag) for tag in (_X_RESOLUTION, _Y_RESOLUTION, _UNIT))
        per_inch = CM_PER_INCH if scale == _PER_CM else 1.0
        if across is not None and down is not None:
            yield _NO_UNIT if scale == _NO_UNIT else 0, across * per_inch, down * per_inch
    except UNREADABLE:
        pass


def _comments(image: Image.Image, head: bytes) -> Iterator[str]:
    """Yield the comments in a file."""
    for key, text in image.info.items():
        if isinstance(text, bytes) and key == "comment":
            yield text[:_COMMENT_BYTES].decode("latin-1")
        elif isinstance(text, str):
            yield f"{key} {text[:_COMMENT_BYTES]}"
    description = getattr(image, "tag_v2", {}).get(_DESCRIPTION)
    if isinstance(description, str):
        yield description
    if image.format == "PPM":
        for comment in _PNM_COMMENT.findall(head[:_COMMENT_BYTES]):
            yield comment.decode("latin-1")
