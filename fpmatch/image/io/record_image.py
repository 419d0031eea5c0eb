"""Pictures inside records: compressed like a file of their own, or bare pixels."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from fpmatch.errors import ImageReadError
from fpmatch.image.io.raw import RawSize, decode_raw
from fpmatch.image.io.readers import reader_named

if TYPE_CHECKING:
    from fpmatch.image.io.byte_reader import Picture
    from fpmatch.image.io.limits import ImageLimits

UNCOMPRESSED: Final = "NONE"
_DEPTH: Final = 8


@dataclass(frozen=True, slots=True)
class RecordImage:
    """Hold an image as a record has it.

    Parameters
    ----------
    data : bytes
        The compressed file, or the pixels.
    compression : str
        Its name in the standard; ``NONE`` for pixels.
    width, height : int
        Size in pixels that the record tells.
    depth : int
        Bits of a pixel.
    dpi : float or None
        Resolution that the record tells, where it does.
    """

    data: bytes = field(repr=False)
    compression: str
    width: int
    height: int
    depth: int = _DEPTH
    dpi: float | None = None


def decode_record_image(
    image: RecordImage, record: str, notes: tuple[str, ...], limits: ImageLimits
) -> Picture:
    """Decode an image that a record has.

    Parameters
    ----------
    image : RecordImage
        The image.
    record : str
        What the record is, for people.
    notes : tuple of str
        What there is to say of the record.
    limits : ImageLimits
        Sizes that are refused, before decoding.

    Returns
    -------
    Picture
        At the record's resolution, else that of the file in it.

    Raises
    ------
    ImageReadError
        If it is damaged, of an unknown compression, or of another size than the record tells.
    ImageError
        If it is too small or too large.
    """
    if image.compression == UNCOMPRESSED:
        if image.depth != _DEPTH:
            raise ImageReadError(f"{record} with bare pixels of {image.depth} bits")
        size = RawSize(max(image.width, 1), max(image.height, 1))
        limits.check(size.width, size.height)
        if len(image.data) < size.bytes:
            raise ImageReadError(f"damaged {record} image (pixels are missing)")
        picture = decode_raw(image.data[: size.bytes], size, limits)
        inner = ""
    else:
        reader = reader_named(image.data)
        if reader is None:
            raise ImageReadError(
                f"{record} with an image that cannot be read ({image.compression})"
            )
        picture = reader.decode(image.data, limits)
        inner = f", {picture.format}"
        if picture.pixels.shape != (image.height, image.width):
            height, width = picture.pixels.shape
            notes += (
                f"its record tells {image.width} x {image.height} pixels of an image that has "
                f"{width} x {height}",
            )
    dpi = picture.dpi if image.dpi is None else image.dpi
    return replace(picture, dpi=dpi, format=record + inner, notes=picture.notes + notes)
