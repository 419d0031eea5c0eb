"""Limits on image files: size in pixels and bytes, and cost of decoding."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Final

from fpmatch.errors import ImageError, ImageReadError

MAX_JPEG_SCANS: Final = 100  # each decodes the whole image again
MAX_TIFF_NUMBERS: Final = 300_000  # in one tag: strips of a row, or tiles of 16 x 16
MAX_TIFF_TAGS: Final = 1000
MAX_PNM_HEADER: Final = 100_000  # bytes, comments and all
MAX_PNM_TEXT: Final = 80_000_000  # bytes of a PNM whose pixels are written in digits

_JPEG_SCAN: Final = b"\xff\xda"
_PNM_TOKENS: Final = re.compile(rb"P[1-6](?:(?:#[^\r\n]*[\r\n]|[ \t\r\n\v\f])+[0-9]+){2,3}")
# Types of tags that Pillow reads into one Python number each.
_TIFF_NUMBERS: Final = frozenset((3, 4, 5, 8, 9, 10, 11, 12, 13, 16, 17, 18))


@dataclass(frozen=True, slots=True)
class ImageLimits:
    """Bound the size of an image that is taken for a fingerprint."""

    min_side_px: int = 48  # holds one ridge neighbourhood
    max_side_px: int = 10_000
    max_megapixels: float = 64.0  # checked before decoding; Pillow refuses more than 89 in any case
    max_file_megabytes: float = 256.0  # checked before reading

    def check(self, width: int, height: int, *, max_megapixels: float | None = None) -> None:
        """Raise ImageError if the size breaks a limit; a format may have a smaller area limit."""
        size = f"image of {width} x {height} pixels"
        megapixels = min(self.max_megapixels, max_megapixels or self.max_megapixels)
        if min(width, height) < self.min_side_px:
            least = f"{self.min_side_px} x {self.min_side_px}"
            raise ImageError(f"{size} is smaller than one ridge neighbourhood ({least})")
        if max(width, height) > self.max_side_px:
            raise ImageError(f"{size} is too large: a side may have {self.max_side_px} pixels")
        if width * height > megapixels * 1e6:
            raise ImageError(f"{size} is too large: more than {megapixels:g} megapixels")


DEFAULT_LIMITS: Final = ImageLimits()


def check_decoder_limits(decoder: str, data: bytes) -> None:
    """Raise ImageReadError if Pillow's `decoder` would take far more time or memory than usual.

    No ordinary program writes such a file.
    """
    if decoder == "JPEG" and data.count(_JPEG_SCAN) > MAX_JPEG_SCANS:
        raise ImageReadError(f"JPEG image of more than {MAX_JPEG_SCANS} scans")
    if decoder == "PPM":
        if _PNM_TOKENS.match(data, 0, MAX_PNM_HEADER) is None:
            raise ImageReadError("damaged PPM image (its header cannot be read)")
        if data[1:2] in b"123" and len(data) > MAX_PNM_TEXT:
            raise ImageReadError(f"PPM image of more than {MAX_PNM_TEXT // 1_000_000} MB of digits")
    if decoder == "TIFF":
        _check_tiff(data)


def _check_tiff(data: bytes) -> None:
    """Check the first directory of tags; a damaged one is left to the decoder."""
    order = "<" if data[:2] == b"II" else ">"
    big = b"+" in data[2:4]
    start_form, count_form, entry_form = ("Q", "Q", "HHQ8s") if big else ("L", "H", "HHL4s")
    try:
        (start,) = struct.unpack_from(order + start_form, data, 8 if big else 4)
        (count,) = struct.unpack_from(order + count_form, data, start)
        if count > MAX_TIFF_TAGS:
            raise ImageReadError(f"TIFF image with {count} tags: too many")
        first = start + struct.calcsize(order + count_form)
        size = struct.calcsize(order + entry_form)
        for at in range(first, first + count * size, size):
            tag, kind, numbers, _ = struct.unpack_from(order + entry_form, data, at)
            if kind in _TIFF_NUMBERS and numbers > MAX_TIFF_NUMBERS:
                raise ImageReadError(f"TIFF image with {numbers} numbers in tag {tag}: too many")
    except (struct.error, OverflowError):
        return
