"""The formats of one picture, found by how a file begins; containers hold such files again."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

from fpmatch.image.io.pillow_formats import SIGNATURES, decode_with_pillow
from fpmatch.image.io.wsq import START_OF_IMAGE, decode_wsq

if TYPE_CHECKING:
    from collections.abc import Callable

    from fpmatch.image.io.byte_reader import Picture
    from fpmatch.image.io.limits import ImageLimits


@dataclass(frozen=True, slots=True)
class ImageReader:
    """Read one format of image file.

    Parameters
    ----------
    name : str
        Name of the format.
    signatures : tuple of bytes
        How its files begin.
    decode : callable
        Makes a `Picture` of a file's bytes within `ImageLimits`; raises an `FpmatchError` that
        names the reason but not the file, and nothing else, whatever the bytes are.
    """

    name: str
    signatures: tuple[bytes, ...]
    decode: Callable[[bytes, ImageLimits], Picture]


_PILLOW_NAMES: Final = tuple(dict.fromkeys(decoder for _, decoder in SIGNATURES))

PICTURE_READERS: Final = (
    *(
        ImageReader(
            name,
            tuple(signature for signature, decoder in SIGNATURES if decoder == name),
            partial(decode_with_pillow, name),
        )
        for name in _PILLOW_NAMES
    ),
    ImageReader("WSQ", (START_OF_IMAGE,), decode_wsq),
)


def reader_named(data: bytes) -> ImageReader | None:
    """Return the reader of the format of one picture that `data` begins like, if there is one."""
    return next((r for r in PICTURE_READERS if data.startswith(r.signatures)), None)
