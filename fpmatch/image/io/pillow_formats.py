"""The raster formats that Pillow decodes; others are left out: some start external programs."""

from __future__ import annotations

import re
import struct
import threading
import warnings
from contextlib import contextmanager
from functools import partial
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from PIL import Image, TiffImagePlugin, UnidentifiedImageError

from fpmatch.errors import FpmatchError, ImageError, ImageReadError
from fpmatch.image.io.grey import grey_image, with_square_pixels
from fpmatch.image.io.resolution import UNREADABLE, tagged_axes
from fpmatch.templates.minutiae import MAX_DPI

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from fpmatch.image.io.grey import GreyImage, ImageLimits

# Name of Pillow's decoder, and the first bytes of its files.
SIGNATURES: Final = {
    "TIFF": (b"II*\x00", b"MM\x00*", b"II+\x00", b"MM\x00+"),
    "PNG": (b"\x89PNG\r\n\x1a\n",),
    "BMP": (b"BM",),
    "JPEG": (b"\xff\xd8\xff",),
    "PPM": tuple(b"P%d" % digit for digit in range(1, 7)),
    "GIF": (b"GIF8",),
    "WEBP": (b"RIFF",),
    "JPEG2000": (b"\x00\x00\x00\x0cjP  ", b"\xff\x4f\xff\x51"),
}
FIRST_OF_SEVERAL: Final = "the first of its several images was read"
# Tags of TIFF, and their values.
_BITS_PER_SAMPLE, _COMPRESSION, _PHOTOMETRIC, _SAMPLE_FORMAT = 258, 259, 262, 339
_WHITE_IS_ZERO, _UNSIGNED = 0, 1
_ORIENTATION: Final = 274  # of TIFF and of Exif; Pillow obeys that of TIFF, and then drops it
_TURNED: Final = range(5, 9)  # its values by which rows become columns
_HEAD_BYTES: Final = 4096

MAX_JPEG_SCANS: Final = 100  # each decodes the whole image again
MAX_TIFF_NUMBERS: Final = 300_000  # in one tag: strips of a row, or tiles of 16 x 16
MAX_TIFF_TAGS: Final = 1000
MAX_PNM_HEADER: Final = 100_000  # bytes, comments and all
MAX_PNM_TEXT: Final = 20_000_000  # bytes of a PNM whose pixels are written in digits
MAX_JP2_BYTES: Final = 50_000_000  # whose boxes are read one by one
MAX_JPEG_SEGMENTS: Final = 10_000
MAX_PARTS: Final = 200_000  # of a file that are read one by one: chunks, segments, boxes, pages
MAX_COLOUR_MEGAPIXELS: Final = 32.0  # of which several copies are made

_JPEG_START, _JPEG_SCAN = b"\xff\xd8", b"\xff\xda"
_TABLE_BYTES: Final = 17  # before its symbols: class and number, and how many of each length
_LOSSLESS_FRAME, _HUFFMAN_TABLES = b"\xc3", b"\xc4"
_JPEG_SEGMENT: Final = re.compile(rb"\xff+([\x01-\xd9\xdb-\xfe])(..)", re.DOTALL)
_PNM_TOKENS: Final = re.compile(rb"P[1-6](?:(?:#[^\r\n]*[\r\n]|[ \t\r\n\v\f])+[0-9]+){2,3}")
_GREY_MODES: Final = frozenset(("1", "L", "I", "I;16", "F"))
# Types of tags that Pillow reads into one Python number each.
_TIFF_NUMBERS: Final = frozenset((3, 4, 5, 8, 9, 10, 11, 12, 13, 16, 17, 18))

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
    """Decode an image file with Pillow's `decoder`; of several images the first."""
    check_decoder_limits(decoder, data)
    if decoder == "JPEG":
        data = _with_lossless_tables(data)
    open_image = partial(Image.open, _Parts(data), formats=[decoder])
    return convert_opened(open_image, limits, decoder, data)


def convert_opened(
    open_image: Callable[[], Image.Image],
    limits: ImageLimits,
    decoder: str = "PIL",
    data: bytes = b"",
) -> GreyImage:
    """Return the image that Pillow opened, upright, with its resolution and notes."""
    try:
        with _decoder_warnings_held():
            image = open_image()
            is_grey = image.mode in _GREY_MODES and not image.has_transparency_data
            most = limits.max_megapixels if is_grey else MAX_COLOUR_MEGAPIXELS
            limits.check(*image.size, MAX_DPI, most=most)  # looking for Exif may decode a PNG
            axes, notes = tagged_axes(image, data[:_HEAD_BYTES])
            limits.check(*image.size, axes and max(axes), most=most)
            if getattr(image, "is_animated", False) and not image.tell():
                notes += (FIRST_OF_SEVERAL,)
            is_turned = _orientation(image) in _TURNED
            samples = _upright(pillow_samples(image), _orientation(image))
            if is_turned and axes is not None:
                axes = axes[::-1]
    except FpmatchError:
        raise
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        size = f"more than {limits.max_megapixels:g} megapixels"
        raise ImageError(f"image is too large: {size}") from error
    except UnidentifiedImageError as error:
        if decoder == "TIFF" and (kind := _unknown_kind(data)):
            raise ImageReadError(f"TIFF image with {kind}, which cannot be read") from error
        raise ImageReadError(f"damaged {decoder} image (its header cannot be read)") from error
    except Exception as error:  # decoders raise almost anything on damage
        raise ImageReadError(f"damaged {decoder} image ({error_text(error)})") from error
    grey = grey_image(samples, format=image.format or "", notes=notes, limits=limits)
    return with_square_pixels(grey, axes, limits)


def _orientation(image: Image.Image) -> int:
    """Return the orientation that a tag states; 1, upright, where none does."""
    try:
        return int(image.getexif().get(_ORIENTATION, 1))
    except UNREADABLE:
        return 1


def _upright(samples: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Return samples turned and mirrored as the tag of their orientation says."""
    if orientation in _TURNED:
        samples = samples.swapaxes(0, 1)
    down, across = orientation in {3, 4, 7, 8}, orientation in {2, 3, 6, 7}
    return samples[:: -1 if down else 1, :: -1 if across else 1]


def error_text(error: Exception) -> str:
    """Return the message of an exception on one line."""
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(reason.split()) or type(error).__name__


@contextmanager
def _decoder_warnings_held() -> Iterator[None]:
    """Silence Pillow's warnings; its warning of a huge image becomes an error."""
    with _warnings_lock, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        yield


def pillow_samples(image: Image.Image) -> NDArray[Any]:
    """Return samples of grey, RGB or RGBA in a type that defines their span."""
    if image.mode.startswith("I;16"):
        return _sixteen_bit_samples(image)
    if image.mode == "La":  # Pillow converts it to no other
        image = image.convert("LA")
    tags = getattr(image, "tag_v2", {})
    unsigned = tags.get(_SAMPLE_FORMAT, (_UNSIGNED,))[0] == _UNSIGNED
    if image.mode == "I" and unsigned and tags.get(_BITS_PER_SAMPLE, (0,))[0] == 32:
        samples = np.asarray(image).view(np.uint32)  # the upper half where 16 bits would not do
        return samples if samples.max(initial=0) <= 0xFFFF else (samples >> 16).astype(np.uint16)
    if image.mode in _GREY_MODES and not image.has_transparency_data:
        return np.asarray(image)
    return np.asarray(image.convert("RGBA" if image.has_transparency_data else "RGB"))


def _sixteen_bit_samples(image: Image.Image) -> NDArray[np.uint16]:
    """Return samples of 9 to 16 bits on the span 0..65535, black at 0."""
    tags = getattr(image, "tag_v2", {})
    bits = int(tags.get(_BITS_PER_SAMPLE, (16,))[0])
    samples = np.asarray(image).astype(np.uint16)
    if bits < 16:
        largest = 2**bits - 1
        scaled = np.minimum(samples, largest).astype(np.uint32) * 0xFFFF // largest
        samples = scaled.astype(np.uint16)
    if tags.get(_PHOTOMETRIC) == _WHITE_IS_ZERO:
        samples = np.uint16(0xFFFF) - samples
    return samples


def _with_lossless_tables(data: bytes) -> bytes:
    """Return a lossless JPEG with the class 0 in its Huffman tables, other files as they are.

    Lossless JPEG has tables of this class only; NIST's encoder writes 1, which decoders refuse.
    """
    tables, at, is_lossless = list[int](), len(_JPEG_START), False
    for _ in range(MAX_JPEG_SEGMENTS):
        segment = _JPEG_SEGMENT.match(data, at)
        if segment is None:
            break
        at = segment.end() - 2 + int.from_bytes(segment[2], "big")
        is_lossless |= segment[1] == _LOSSLESS_FRAME
        table = segment.end()
        while segment[1] == _HUFFMAN_TABLES and table + _TABLE_BYTES <= min(at, len(data)):
            tables.append(table)
            table += _TABLE_BYTES + sum(data[table + 1 : table + _TABLE_BYTES])
    if not is_lossless:
        return data
    changed = bytearray(data)
    for table in tables:
        changed[table] &= 0x0F
    return bytes(changed)


def _unknown_kind(data: bytes) -> str:
    """Describe a TIFF whose tags are intact but whose kind is not supported; else return ""."""
    try:
        header = data[:8] if data[2:3] == b"*" or data[3:4] == b"*" else data[:16]
        stream = BytesIO(data)
        with _decoder_warnings_held():
            tags = TiffImagePlugin.ImageFileDirectory_v2(header)
            stream.seek(tags.next)
            tags.load(stream)
            bits = "/".join(map(str, tags.get(_BITS_PER_SAMPLE, (1,))[:4]))
            return f"{bits} bits a sample and compression {int(tags[_COMPRESSION])}"
    except Exception:  # noqa: BLE001  # damaged tags
        return ""


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
    if decoder == "JPEG2000" and len(data) > MAX_JP2_BYTES:
        raise ImageReadError(f"JPEG 2000 image of more than {MAX_JP2_BYTES // 1_000_000} MB")
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
