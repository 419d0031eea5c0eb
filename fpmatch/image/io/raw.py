"""Bare pixels: files without a header, whose size the caller gives."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.image.io.grey import GreyImage

if TYPE_CHECKING:
    from fpmatch.image.io.limits import ImageLimits

_SIZE: Final = re.compile(r"([1-9]\d{0,5})[x×X]([1-9]\d{0,5})", re.ASCII)


@dataclass(frozen=True, slots=True)
class RawSize:
    """The positive size of an image whose file is its pixels, row by row, 8 bits each."""

    width: int
    height: int

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ImageError(f"a size must be positive, not {self}")

    @property
    def bytes(self) -> int:
        """Number of bytes of the file."""
        return self.width * self.height

    @classmethod
    def parse(cls, text: str) -> RawSize:
        """Return the size that ``WIDTHxHEIGHT`` names; raise ImageError for other text."""
        size = _SIZE.fullmatch(text.strip())
        if size is None:
            raise ImageError(f"a size is written WIDTHxHEIGHT, as in 388x374, not {text!r}")
        return cls(int(size[1]), int(size[2]))

    def __str__(self) -> str:
        return f"{self.width}x{self.height}"


def decode_raw(data: bytes, size: RawSize, limits: ImageLimits) -> GreyImage:
    """Return `data` as the pixels of an image of `size`; raise ImageError if they do not fit."""
    limits.check(size.width, size.height)
    if len(data) != size.bytes:
        raise ImageError(f"{len(data)} bytes are no {size} pixels of 8 bits")
    pixels = np.frombuffer(data, np.uint8).reshape(size.height, size.width)
    return GreyImage(pixels.copy(), format="raw")
