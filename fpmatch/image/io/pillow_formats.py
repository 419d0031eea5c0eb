"""The raster formats that Pillow decodes; others are left out: some start external programs."""

from __future__ import annotations

import re
import struct
import threading
import warnings
from functools import partial
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from PIL import Image, UnidentifiedImageError

from fpmatch.errors import FpmatchError, ImageError, ImageReadError
from fpmatch.image.io.grey import UNREADABLE, grey_image, usable_axes, with_square_pixels

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.image.io.grey import GreyImage, ImageLimits

# Name of Pillow's decoder, and the first bytes of its files.
SIGNATURES: Final = {
    "TIFF": (b"II*\x00", b"MM\x00*"),
    "PNG": (b"\x89PNG\r\n\x1a\n",),
    "BMP": (b"BM",),
    "JPEG": (b"\xff\xd8\xff",),
    "PPM": (b"P4", b"P5", b"P6"),
    "GIF": (b"GIF8",),
    "WEBP": (b"RIFF",),
    "JPEG2000": (b"\x00\x00\x00\x0cjP  ", b"\xff\x4f\xff\x51"),
}
FIRST_OF_SEVERAL: Final = "the first of its several images was read"
ASSUMED_UNIT: Final = "its resolution has no unit; dots per inch assumed"
_PHOTOMETRIC, _WHITE_IS_ZERO = 262, 0  # a tag of TIFF, and its value
_ORIENTATION: Final = 274  # of TIFF and of Exif; Pillow obeys that of TIFF, and then drops it
_TURNED: Final = range(5, 9)  # its values by which rows become columns
_GREY_MODES: Final = frozenset(("1", "L", "I", "I;16", "I;16B", "I;16L", "I;16N", "F"))
_COMMENT_BYTES: Final = 4096  # searched in each comment
_IN_A_COMMENT: Final = re.compile(
    r"\b(?:ppi|dpi)\b[^\w\n]{0,3}(\d{3,4}(?:\.\d+)?)\b|\b(\d{3,4}(?:\.\d+)?) ?(?:ppi|dpi)\b",
    re.IGNORECASE | re.ASCII,
)

MAX_JPEG_SCANS: Final = 100  # each decodes the whole image again
MAX_TIFF_NUMBERS: Final = 300_000  # in one tag: strips of a row, or tiles of 16 x 16
MAX_PARTS: Final = 200_000  # of a file that are read one by one: chunks, segments, boxes, pages
MAX_COLOUR_MEGAPIXELS: Final = 32.0  # of which several copies are made

_JPEG_SCAN: Final = b"\xff\xda"
_LOSSLESS_FRAME: Final = re.compile(rb"\xff\xc3\x00[\x0b\x11][\x02-\x10]")
_TABLE_OF_CLASS_1: Final = re.compile(rb"(\xff\xc4..)([\x10-\x13])", re.DOTALL)
_TIFF_BYTES: Final = {3: 2, 4: 4, 5: 8, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4}
"""Types of tags that Pillow reads into one Python number each, and their bytes."""

_warnings_lock = threading.Lock()  # warning filters are global to the process


class _Parts(BytesIO):
    """The bytes of a file, which refuse to be read in more than `MAX_PARTS` parts."""

    parts = 0

    def read(self, size: int | None = -1) -> bytes:
        """Return the next bytes; raise ImageReadError after too many parts."""
        self.parts += 1
        if self.parts > MAX_PARTS:
            raise ImageReadError(f"an image file of more than {MAX_PARTS} parts")
        return super().read(size)


def decode_with_pillow(decoder: str, data: bytes, limits: ImageLimits) -> GreyImage:
    """Decode an image file with Pillow's `decoder`; of several images the first.

    Raises ImageReadError where that would take far more time or memory than usual, which no
    ordinary program writes.
    """
    if decoder == "TIFF":
        _check_tiff(data)
    if decoder == "JPEG":
        if data.count(_JPEG_SCAN) > MAX_JPEG_SCANS:
            raise ImageReadError(f"JPEG image of more than {MAX_JPEG_SCANS} scans")
        head, scan, rest = data.partition(_JPEG_SCAN)
        if _LOSSLESS_FRAME.search(head):  # whose tables have class 0, but NIST's encoder writes 1
            head = _TABLE_OF_CLASS_1.sub(lambda table: table[1] + bytes([table[2][0] & 15]), head)
            data = head + scan + rest
    open_image = partial(Image.open, _Parts(data), formats=[decoder])
    return convert_opened(open_image, limits, decoder)


def convert_opened(
    open_image: Callable[[], Image.Image], limits: ImageLimits, decoder: str = "PIL"
) -> GreyImage:
    """Return the image that Pillow opened, upright, with its resolution and notes."""
    try:
        with _warnings_lock, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image = open_image()
            is_grey = image.mode in _GREY_MODES and not image.has_transparency_data
            most = limits.max_megapixels if is_grey else MAX_COLOUR_MEGAPIXELS
            axes, notes = _tagged_axes(image)
            limits.check(*image.size, axes and max(axes), most=most)
            if getattr(image, "is_animated", False) and not image.tell():
                notes += (FIRST_OF_SEVERAL,)
            if _orientation(image) in _TURNED and axes is not None:
                axes = axes[::-1]
            samples = _samples(image, is_grey=is_grey)
            orientation = _orientation(image)
    except FpmatchError:
        raise
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        size = f"more than {limits.max_megapixels:g} megapixels"
        raise ImageError(f"image is too large: {size}") from error
    except UnidentifiedImageError as error:
        why = "its header cannot be read, or it is of a rare kind"
        raise ImageReadError(f"damaged {decoder} image ({why})") from error
    except Exception as error:  # decoders raise almost anything on damage
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        words = " ".join(reason.split()) or type(error).__name__
        raise ImageReadError(f"damaged {decoder} image ({words})") from error
    if orientation in _TURNED:
        samples = samples.swapaxes(0, 1)
    down, across = orientation in {3, 4, 7, 8}, orientation in {2, 3, 6, 7}
    upright = samples[:: -1 if down else 1, :: -1 if across else 1]
    grey = grey_image(upright, format=image.format or "", notes=notes, limits=limits)
    return with_square_pixels(grey, axes, limits)


def _tagged_axes(image: Image.Image) -> tuple[tuple[float, float] | None, tuple[str, ...]]:
    """Return the resolution of an opened image file, and a note where it is doubtful.

    It is taken across and down from its tag, as Pillow reads it, else from a comment such as NIST's
    ``PPI 500``.
    """
    for key, note in (("dpi", ()), ("resolution", (ASSUMED_UNIT,))):
        pair = image.info.get(key)
        axes = usable_axes(*pair) if isinstance(pair, tuple) and len(pair) == 2 else None
        if axes is not None:
            return axes, note
    for name, text in image.info.items():
        if isinstance(text, str) or (name == "comment" and isinstance(text, bytes)):
            part = text[:_COMMENT_BYTES]
            comment = part.decode("latin-1") if isinstance(part, bytes) else part
            match = _IN_A_COMMENT.search(f"{name} {comment}")
            dpi = match and (match[1] or match[2])
            axes = usable_axes(dpi, dpi)
            if axes is not None:
                return axes, ()
    return None, ()


def _orientation(image: Image.Image) -> int:
    """Return the orientation that a tag states; 1, upright, where none does."""
    try:
        return int(image.getexif().get(_ORIENTATION, 1))
    except UNREADABLE:
        return 1


def _samples(image: Image.Image, *, is_grey: bool) -> NDArray[Any]:
    """Return samples of grey, RGB or RGBA in a type that defines their span."""
    if not is_grey:
        return np.asarray(image.convert("RGBA" if image.has_transparency_data else "RGB"))
    samples = np.asarray(image)
    if image.mode.startswith("I;16"):
        samples = samples.astype(np.uint16)
        if getattr(image, "tag_v2", {}).get(_PHOTOMETRIC) == _WHITE_IS_ZERO:
            samples = np.uint16(0xFFFF) - samples
    return samples


def _check_tiff(data: bytes) -> None:
    """Check the first directory of tags; a damaged one is left to the decoder."""
    order = "<" if data[:2] == b"II" else ">"
    total = 0
    try:
        (start,) = struct.unpack_from(order + "L", data, 4)
        (count,) = struct.unpack_from(order + "H", data, start)
        for at in range(start + 2, start + 2 + 12 * count, 12):
            tag, kind, numbers, place = struct.unpack_from(order + "HHLL", data, at)
            if kind in _TIFF_BYTES and numbers > MAX_TIFF_NUMBERS:
                raise ImageReadError(f"TIFF image with {numbers} numbers in tag {tag}: too many")
            size = numbers * _TIFF_BYTES.get(kind, 1)
            total += size if place + size <= len(data) else 0
    except struct.error:
        return
    if total > len(data):
        raise ImageReadError("damaged TIFF image (its tags overlap)")
