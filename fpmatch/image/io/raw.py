"""Bare pixels: files without a header, whose size somebody must tell."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.image.io.byte_reader import Picture

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.image.io.limits import ImageLimits

_SIZE: Final = re.compile(r"([1-9]\d{0,5})[x×X]([1-9]\d{0,5})", re.ASCII)


@dataclass(frozen=True, slots=True)
class RawSize:
    """Hold the size in pixels of a picture whose file is its pixels, row by row, 8 bits each.

    Parameters
    ----------
    width, height : int
        Both at least 1.

    Raises
    ------
    ImageError
        If one is not.

    Examples
    --------
    >>> RawSize.parse("388x374").bytes
    145112
    """

    width: int
    height: int

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ImageError(f"a size must be positive, not {self.width} x {self.height}")

    @property
    def bytes(self) -> int:
        """Number of bytes of the file."""
        return self.width * self.height

    @classmethod
    def parse(cls, text: str) -> RawSize:
        """Return the size that ``WIDTHxHEIGHT`` names.

        Raises
        ------
        ImageError
            If `text` is not of that form.
        """
        size = _SIZE.fullmatch(text.strip())
        if size is None:
            raise ImageError(f"a size is written WIDTHxHEIGHT, as in 388x374, not {text!r}")
        return cls(int(size[1]), int(size[2]))

    def __str__(self) -> str:
        return f"{self.width}x{self.height}"


def raw_size_of(length: int, sizes: Sequence[RawSize]) -> RawSize | None:
    """Return the first of `sizes` that a file of `length` bytes can have; None if it has none."""
    return next((size for size in sizes if size.bytes == length), None)


def decode_raw(data: bytes, size: RawSize, limits: ImageLimits) -> Picture:
    """Return the picture whose pixels `data` are.

    Raises
    ------
    ImageError
        If it is too small or too large, or `data` has another length than its pixels.
    """
    limits.check(size.width, size.height)
    if len(data) != size.bytes:
        raise ImageError(f"{len(data)} bytes are no {size} pixels of 8 bits")
    pixels = np.frombuffer(data, np.uint8).reshape(size.height, size.width)
    return Picture(pixels.copy(), format="raw")
