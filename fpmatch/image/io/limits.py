"""`ImageLimits`: how large a file and a picture may be that is taken for a fingerprint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from fpmatch.errors import ImageError


@dataclass(frozen=True, slots=True)
class ImageLimits:
    """Bound the size of an image that is taken for a fingerprint.

    Parameters
    ----------
    min_side_px : int
        Shortest side; below it not one ridge neighbourhood fits in.
    max_side_px : int
        Longest side.
    max_megapixels : float
        Largest area in millions of pixels, checked before a pixel is decoded. Files above
        Pillow's own limit (89 megapixels) are refused whatever stands here.
    max_file_megabytes : float
        Largest file, checked before it is read.
    """

    min_side_px: int = 48
    max_side_px: int = 10_000
    max_megapixels: float = 64.0
    max_file_megabytes: float = 256.0

    def check(self, width: int, height: int, *, max_megapixels: float | None = None) -> None:
        """Raise ImageError unless an image of `width` x `height` pixels keeps the limits.

        `max_megapixels` is that of the format, where it has one of its own.
        """
        size = f"image of {width} x {height} pixels"
        megapixels = min(self.max_megapixels, max_megapixels or self.max_megapixels)
        if min(width, height) < self.min_side_px:
            raise ImageError(
                f"{size} is smaller than one ridge neighbourhood "
                f"({self.min_side_px} x {self.min_side_px})"
            )
        if max(width, height) > self.max_side_px:
            raise ImageError(f"{size} is too large: a side may have {self.max_side_px} pixels")
        if width * height > megapixels * 1e6:
            raise ImageError(f"{size} is too large: more than {megapixels:g} megapixels")


DEFAULT_LIMITS: Final = ImageLimits()
