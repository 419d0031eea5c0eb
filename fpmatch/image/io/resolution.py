"""Find the resolution in an image file, in every place where it may stand."""

from __future__ import annotations

import re
import struct
from typing import TYPE_CHECKING, Any, Final

from fpmatch.minutiae import MAX_DPI, MIN_DPI

if TYPE_CHECKING:
    from collections.abc import Iterator

    from PIL import Image

TAGGED_DPI_DIGITS: Final = 1  # 500 dpi in a tag per metre comes back as 499.999
MM_PER_INCH: Final = 25.4
CM_PER_INCH: Final = 2.54
_X_RESOLUTION, _Y_RESOLUTION, _UNIT, _DESCRIPTION = 282, 283, 296, 270  # TIFF's tags, and Exif's
_NO_UNIT, _PER_CM = 1, 3
_RECORD_PER_INCH, _RECORD_PER_CM = 1, 2
_COMMENT_BYTES: Final = 4096  # of a header and of each comment are searched
_IN_A_COMMENT: Final = re.compile(
    r"\b(?:ppi|dpi)\b[^\w\n]{0,3}(\d{3,4}(?:\.\d+)?)\b|\b(\d{3,4}(?:\.\d+)?) ?(?:ppi|dpi)\b",
    re.IGNORECASE | re.ASCII,
)
_PNM_COMMENT: Final = re.compile(rb"#[^\r\n]*")
# What a damaged tag makes Pillow raise: a resolution that cannot be read is none.
_UNREADABLE: Final = (
    ArithmeticError,
    AttributeError,
    LookupError,
    OSError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
)

NO_UNIT: Final = "its resolution has no unit; dots per inch assumed"


def usable_dpi(horizontal: object, vertical: object = None) -> float | None:
    """Return a resolution as a file tells it, None where it cannot be meant.

    Parameters
    ----------
    horizontal, vertical : number
        Dots per inch along both axes (default: the same along both).

    Returns
    -------
    float or None
        Rounded to a tenth; None unless it is above 100 and up to 4000 dpi, lower ones being what
        programs write that do not know (1, 72, 96), and the same along both axes.

    Examples
    --------
    >>> usable_dpi(499.9993), usable_dpi(72), usable_dpi(500, 600)
    (500.0, None, None)
    """
    dpi = _rounded(horizontal)
    same = vertical is None or dpi == _rounded(vertical)
    return dpi if dpi is not None and same and MIN_DPI < dpi <= MAX_DPI else None


def dpi_of_record(pixels: int, *, per_cm: bool) -> float:
    """Return the resolution that a record tells in whole pixels an inch or a centimetre.

    Whole pixels a centimetre stand for a range of 2.54 dpi: where a multiple of 100 lies in it
    that is meant, else the nearest whole number.

    Examples
    --------
    >>> dpi_of_record(197, per_cm=True), dpi_of_record(224, per_cm=True)
    (500.0, 569.0)
    """
    if not per_cm:
        return float(pixels)
    exact = pixels * CM_PER_INCH
    hundreds = round(exact, -2)
    return float(hundreds if abs(hundreds - exact) <= CM_PER_INCH / 2 else round(exact))


def dpi_in_units(units: int, across: int, down: int) -> float | None:
    """Return the resolution that a record tells by a code of its units and a number an axis.

    The code is that of ANSI/NIST-ITL and ISO/IEC 19794-4: 1 for pixels an inch, 2 a centimetre.

    Examples
    --------
    >>> dpi_in_units(2, 197, 197), dpi_in_units(1, 500, 500), dpi_in_units(0, 500, 500)
    (500.0, 500.0, None)
    """
    if units not in (_RECORD_PER_INCH, _RECORD_PER_CM):
        return None
    per_cm = units == _RECORD_PER_CM
    return usable_dpi(*(dpi_of_record(pixels, per_cm=per_cm) for pixels in (across, down)))


def tagged_dpi(picture: Image.Image, head: bytes) -> tuple[float | None, tuple[str, ...]]:
    """Return the resolution that an image file tells, and a note where it is doubtful.

    Parameters
    ----------
    picture : PIL.Image.Image
        The file, opened.
    head : bytes
        How it begins.

    Returns
    -------
    float or None
        From the format's own tag, else from Exif, else from a comment such as NIST's ``PPI 500``.
    tuple of str
        Notes: that the unit is missing, or that the axes differ.
    """
    notes: list[str] = []
    for unit, horizontal, vertical in _pairs(picture, head):
        dpi = usable_dpi(horizontal, vertical)
        if dpi is not None:
            return dpi, (NO_UNIT,) if unit == _NO_UNIT else ()
        if usable_dpi(horizontal) and usable_dpi(vertical):
            notes.append(
                f"its resolution is not the same along both axes ({float(horizontal):g} and "
                f"{float(vertical):g} dpi): left aside"
            )
    for comment in _comments(picture, head):
        if (told := _IN_A_COMMENT.search(comment[:_COMMENT_BYTES])) is not None:
            dpi = usable_dpi(told[1] or told[2])
            if dpi is not None:
                return dpi, ()
    return None, tuple(notes[:1])


def _rounded(value: object) -> float | None:
    try:
        return round(float(value), TAGGED_DPI_DIGITS)  # type: ignore[arg-type]
    except _UNREADABLE:
        return None


def _pairs(picture: Image.Image, head: bytes) -> Iterator[tuple[int, Any, Any]]:
    """Yield the unit (1 for none) and both resolutions of every tag that has them, per inch."""
    for unit, key in ((0, "dpi"), (_NO_UNIT, "resolution")):
        pair = picture.info.get(key)
        if isinstance(pair, tuple) and len(pair) == 2:
            yield unit, *pair
    try:
        exif = picture.getexif()
        across, down, scale = (exif.get(tag) for tag in (_X_RESOLUTION, _Y_RESOLUTION, _UNIT))
        per_inch = CM_PER_INCH if scale == _PER_CM else 1.0
        if across is not None and down is not None:
            yield _NO_UNIT if scale == _NO_UNIT else 0, across * per_inch, down * per_inch
    except _UNREADABLE:
        pass
    if (box := head.find(b"resd")) >= 0:  # JPEG 2000's resolution for showing
        try:
            numbers = struct.unpack_from(">4H2b", head, box + 4)
            down, down_over, across, across_over, down_ten, across_ten = numbers
            per_inch = MM_PER_INCH / 1000
            yield (
                0,
                across / across_over * 10.0**across_ten * per_inch,
                down / down_over * 10.0**down_ten * per_inch,
            )
        except _UNREADABLE:
            pass


def _comments(picture: Image.Image, head: bytes) -> Iterator[str]:
    """Yield what the file says in words."""
    for key, text in picture.info.items():
        if isinstance(text, bytes) and key == "comment":
            yield text[:_COMMENT_BYTES].decode("latin-1")
        elif isinstance(text, str):
            yield f"{key} {text[:_COMMENT_BYTES]}"
    description = getattr(picture, "tag_v2", {}).get(_DESCRIPTION)
    if isinstance(description, str):
        yield description
    if picture.format == "PPM":
        for comment in _PNM_COMMENT.findall(head[:_COMMENT_BYTES]):
            yield comment.decode("latin-1")
