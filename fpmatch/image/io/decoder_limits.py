"""Refuse files that take far longer, or far more memory, to decode than their pictures are worth.

Sizes in pixels are checked elsewhere. What is refused here are small pictures in absurd files:
each check is one look at the bytes, and no file that a program writes in earnest comes near.
"""

from __future__ import annotations

import re
import struct
from typing import TYPE_CHECKING, Final

from fpmatch.errors import ImageReadError

if TYPE_CHECKING:
    from collections.abc import Callable

MAX_JPEG_SCANS: Final = 100  # of a progressive JPEG; each one goes over the whole picture
MAX_TIFF_NUMBERS: Final = 300_000  # in one tag: strips of a row, or tiles of 16 x 16
MAX_TIFF_TAGS: Final = 1000
MAX_PNM_HEADER: Final = 100_000  # bytes, comments and all
MAX_PNM_TEXT: Final = 80_000_000  # bytes of a PNM whose pixels are written in digits

_JPEG_SCAN: Final = b"\xff\xda"
_PNM_TOKENS: Final = re.compile(rb"P[1-6](?:(?:#[^\r\n]*[\r\n]|[ \t\r\n\v\f])+[0-9]+){2,3}")
# Types of tags that are read into numbers of their own, not kept as bytes.
_TIFF_NUMBERS: Final = frozenset((3, 4, 5, 8, 9, 10, 11, 12, 13, 16, 17, 18))


def check_decoder_limits(decoder: str, data: bytes) -> None:
    """Raise ImageReadError if `data`, a file for `decoder`, is an absurd one.

    Parameters
    ----------
    decoder : str
        Name of Pillow's decoder.
    data : bytes
        The file.

    Raises
    ------
    ImageReadError
        If a JPEG has hundreds of scans, a TIFF hundreds of thousands of strips or tags that
        overlap, or a PNM a header or pixels in digits of tens of megabytes.

    Examples
    --------
    >>> check_decoder_limits("PPM", b"P5 64 64 255 ")
    """
    check = _CHECKS.get(decoder)
    if check is not None:
        check(data)


def _refuse_jpeg(data: bytes) -> None:
    if data.count(_JPEG_SCAN) > MAX_JPEG_SCANS:
        raise ImageReadError(f"JPEG image of more than {MAX_JPEG_SCANS} scans, which is absurd")


def _refuse_pnm(data: bytes) -> None:
    if _PNM_TOKENS.match(data, 0, MAX_PNM_HEADER) is None:
        raise ImageReadError("damaged PPM image (its header cannot be read)")
    if data[1:2] in b"123" and len(data) > MAX_PNM_TEXT:
        megabytes = MAX_PNM_TEXT // 1_000_000
        raise ImageReadError(f"PPM image of more than {megabytes} MB of digits, which is absurd")


def _refuse_tiff(data: bytes) -> None:
    """Look through the first directory of tags; what cannot be read is left to the decoder."""
    order = "<" if data[:2] == b"II" else ">"
    big = b"+" in data[2:4]
    start_form, count_form, entry_form = ("Q", "Q", "HHQ8s") if big else ("L", "H", "HHL4s")
    try:
        (start,) = struct.unpack_from(order + start_form, data, 8 if big else 4)
        (count,) = struct.unpack_from(order + count_form, data, start)
        if count > MAX_TIFF_TAGS:
            raise ImageReadError(f"TIFF image of {count} tags, which is absurd")
        first = start + struct.calcsize(order + count_form)
        size = struct.calcsize(order + entry_form)
        for at in range(first, first + count * size, size):
            tag, kind, numbers, _ = struct.unpack_from(order + entry_form, data, at)
            if kind in _TIFF_NUMBERS and numbers > MAX_TIFF_NUMBERS:
                raise ImageReadError(
                    f"TIFF image of {numbers} numbers in tag {tag}, which is absurd"
                )
    except (struct.error, OverflowError):
        return


_CHECKS: Final[dict[str, Callable[[bytes], None]]] = {
    "JPEG": _refuse_jpeg,
    "PPM": _refuse_pnm,
    "TIFF": _refuse_tiff,
}
