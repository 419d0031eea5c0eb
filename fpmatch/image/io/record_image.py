"""Images inside records: compressed like a file of their own, or bare pixels."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from fpmatch.errors import ImageReadError
from fpmatch.image.io.raw import RawSize, decode_raw

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.grey import GreyImage
    from fpmatch.image.io.limits import ImageLimits

    DecodeFile = Callable[[bytes, ImageLimits], GreyImage | None]
    """Decode an image file that is no record; None if its format is unknown."""

UNCOMPRESSED: Final = "NONE"
_DEPTH: Final = 8


@dataclass(frozen=True, slots=True)
class RecordImage:
    """Hold an image as a record describes it."""

    data: bytes = field(repr=False)  # the compressed file, or the pixels
    compression: str  # its name in the standard; NONE for pixels
    width: int  # pixels, according to the record
    height: int
    depth: int = _DEPTH  # bits of a pixel
    dpi: float | None = None  # resolution according to the record


def decode_record_image(
    image: RecordImage, record: str, limits: ImageLimits, decode_file: DecodeFile
) -> GreyImage:
    """Decode the image of a record, at the record's resolution if known, else at its own.

    `record` is the record's kind, for messages. Raises ImageReadError if the image is damaged or
    of an unknown compression, ImageError if it is too small or too large.
    """
    if image.compression == UNCOMPRESSED:
        if image.depth != _DEPTH:
            raise ImageReadError(f"{record} with bare pixels of {image.depth} bits")
        size = RawSize(max(image.width, 1), max(image.height, 1))
        limits.check(size.width, size.height)
        if len(image.data) < size.bytes:
            raise ImageReadError(f"damaged {record} image (pixels are missing)")
        decoded = decode_raw(image.data[: size.bytes], size, limits)
        return replace(decoded, dpi=image.dpi, format=record)
    found = decode_file(image.data, limits)
    if found is None:
        raise ImageReadError(f"{record} with an image that cannot be read ({image.compression})")
    notes = found.notes
    height, width = found.pixels.shape
    if (height, width) != (image.height, image.width):
        notes += (
            f"its record gives a size of {image.width} x {image.height} pixels, but its image has "
            f"{width} x {height}",
        )
    dpi = found.dpi if image.dpi is None else image.dpi
    return replace(found, dpi=dpi, format=f"{record}, {found.format}", notes=notes)
