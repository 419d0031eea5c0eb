"""The raster formats that Pillow decodes.

The list is closed on purpose: Pillow knows others that start outside programs to decode a file.
"""

from __future__ import annotations

import threading
import warnings
from contextlib import contextmanager
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from PIL import Image, TiffImagePlugin, UnidentifiedImageError

from fpmatch.errors import FpmatchError, ImageError, ImageReadError
from fpmatch.image.io.byte_reader import Picture
from fpmatch.image.io.decoder_limits import check_decoder_limits
from fpmatch.image.io.grey import as_grey, flatten_transparency
from fpmatch.image.io.resolution import tagged_dpi

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fpmatch.image.io.limits import ImageLimits

# First bytes of a file and the name of Pillow's decoder for it.
SIGNATURES: Final = (
    (b"II*\x00", "TIFF"),
    (b"MM\x00*", "TIFF"),
    (b"II+\x00", "TIFF"),
    (b"MM\x00+", "TIFF"),
    (b"\x89PNG\r\n\x1a\n", "PNG"),
    (b"BM", "BMP"),
    (b"\xff\xd8\xff", "JPEG"),
    *((b"P%d" % digit, "PPM") for digit in range(1, 7)),
    (b"GIF8", "GIF"),
    (b"RIFF", "WEBP"),
    (b"\x00\x00\x00\x0cjP  ", "JPEG2000"),
    (b"\xff\x4f\xff\x51", "JPEG2000"),
)
FIRST_OF_SEVERAL: Final = "the first of its pictures is read, of several"
TIFF_BITS_PER_SAMPLE: Final = 258
TIFF_COMPRESSION: Final = 259
TIFF_PHOTOMETRIC: Final = 262
TIFF_SAMPLE_FORMAT: Final = 339
TIFF_WHITE_IS_ZERO: Final = 0
TIFF_UNSIGNED: Final = 1
_HEAD_BYTES: Final = 4096

_warnings_lock = threading.Lock()


def decode_with_pillow(decoder: str, data: bytes, limits: ImageLimits) -> Picture:
    """Decode a picture; of a file with several the first.

    Parameters
    ----------
    decoder : str
        Name of Pillow's decoder.
    data : bytes
        The file.
    limits : ImageLimits
        Sizes that are refused, before decoding.

    Returns
    -------
    Picture
        Its grey values, with the resolution that the file tells.

    Raises
    ------
    ImageReadError
        If the file is damaged.
    ImageError
        If the picture is too small or too large, or its values make no grey image.
    """
    check_decoder_limits(decoder, data)
    try:
        with (
            _decoder_warnings_held(),
            Image.open(BytesIO(data), formats=[decoder]) as picture,
        ):
            limits.check(*picture.size)
            dpi, notes = tagged_dpi(picture, data[:_HEAD_BYTES])
            if getattr(picture, "is_animated", False):
                notes += (FIRST_OF_SEVERAL,)
            samples = _samples(picture)
    except FpmatchError:
        raise
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise ImageError(
            f"image is too large: more than {limits.max_megapixels:g} megapixels"
        ) from error
    except UnidentifiedImageError as error:
        reason = _unknown_kind(data) if decoder == "TIFF" else ""
        if reason:
            raise ImageReadError(f"TIFF image with {reason}, which cannot be read") from error
        raise ImageReadError(f"damaged {decoder} image (its header cannot be read)") from error
    except Exception as error:  # decoders of a damaged file raise almost anything
        raise ImageReadError(f"damaged {decoder} image ({in_words(error)})") from error
    if samples.ndim == 3 and samples.shape[2] == 4 and samples.dtype == np.uint8:
        pixels, on_ground = flatten_transparency(samples)
        return Picture(pixels, dpi, decoder, notes + on_ground)
    return Picture(as_grey(samples, limits=limits), dpi, decoder, notes)


def in_words(error: Exception) -> str:
    """Return the reason that an exception gives, on one line."""
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(reason.split()) or type(error).__name__


@contextmanager
def _decoder_warnings_held() -> Iterator[None]:
    """Keep Pillow's warnings from the user; its warning of a huge image becomes an error.

    Python's warning filters are global to the process, so one thread at a time changes them.
    """
    with _warnings_lock, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        yield


def _samples(picture: Image.Image) -> NDArray[Any]:
    """Return the picture's samples in a type that says their span, grey, RGB or RGBA."""
    if picture.mode.startswith("I;16"):
        return _sixteen_bit_samples(picture)
    if picture.mode == "I" and _is_unsigned_tiff(picture):
        return _thirty_two_bit_samples(picture)
    if picture.mode in {"1", "L", "I", "F"} and not picture.has_transparency_data:
        return np.asarray(picture)
    return np.asarray(picture.convert("RGBA" if picture.has_transparency_data else "RGB"))


def _sixteen_bit_samples(picture: Image.Image) -> NDArray[np.uint16]:
    """Return samples of 9 to 16 bits on the span 0..65535, black at 0."""
    tags = getattr(picture, "tag_v2", {})
    bits = int(tags.get(TIFF_BITS_PER_SAMPLE, (16,))[0])
    samples = np.asarray(picture).astype(np.uint16)
    if bits < 16:
        largest = 2**bits - 1
        scaled = np.minimum(samples, largest).astype(np.uint32) * 0xFFFF // largest
        samples = scaled.astype(np.uint16)
    if tags.get(TIFF_PHOTOMETRIC) == TIFF_WHITE_IS_ZERO:
        samples = np.uint16(0xFFFF) - samples
    return samples


def _is_unsigned_tiff(picture: Image.Image) -> bool:
    tags = getattr(picture, "tag_v2", {})
    return bool(
        tags.get(TIFF_BITS_PER_SAMPLE, (0,))[0] == 32
        and tags.get(TIFF_SAMPLE_FORMAT, (TIFF_UNSIGNED,))[0] == TIFF_UNSIGNED
    )


def _thirty_two_bit_samples(picture: Image.Image) -> NDArray[Any]:
    """Return samples of 32 bits as they are where 16 would do, else their upper half."""
    samples = np.asarray(picture).view(np.uint32)
    if samples.max(initial=0) <= 0xFFFF:
        return samples
    return (samples >> 16).astype(np.uint16)


def _unknown_kind(data: bytes) -> str:
    """Return what a TIFF is, in words, that is whole as far as its tags go; "" for another."""
    try:
        header = data[:8] if data[2:3] == b"*" or data[3:4] == b"*" else data[:16]
        tags = TiffImagePlugin.ImageFileDirectory_v2(header)
        stream = BytesIO(data)
        stream.seek(tags.next)
        with _decoder_warnings_held():
            tags.load(stream)
        bits = tags.get(TIFF_BITS_PER_SAMPLE, (1,))
        return f"{'/'.join(map(str, bits[:4]))} bits a sample and compression " + str(
            int(tags[TIFF_COMPRESSION])
        )
    except Exception:  # noqa: BLE001  # then it is damaged, which the caller says
        return ""
