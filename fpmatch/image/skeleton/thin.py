"""From an enhanced image to a skeleton: which pixels are ridge, and thinning to one pixel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.skeleton import _small_parts_kernel, _thin_kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.preprocess.arrays import Floats, Grey, Mask

MIN_RIDGE_AREA_PX: Final = 40
MIN_HOLE_AREA_PX: Final = 14
WORD_BITS: Final = 64
AROUND: Final = ((0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1))
"""Steps (dy, dx) to the neighbours of a pixel, counter-clockwise from east."""
_BITS: Final = np.arange(256) >> np.arange(8)[:, None] & 1
"""The eight neighbours of each byte of neighbours, counter-clockwise from east, (8, 256)."""
_PARTS: Final = ((1 - _BITS[::2]) & (_BITS[1::2] | np.roll(_BITS, -2, axis=0)[::2])).sum(axis=0)
SIMPLE: Final = ((_PARTS == 1) & (_BITS.sum(axis=0) >= 2)).astype(np.uint8)
"""For each byte of neighbours, whether the pixel is no end and not needed to connect.

That is: at least two neighbours, all in one eight-connected part, and a background neighbour to the
east, north, west or south (so that no hole is made).
"""
CROSSING_NUMBER: Final = ((_BITS ^ np.roll(_BITS, 1, axis=0)).sum(axis=0) // 2).astype(np.uint8)
"""For each byte of neighbours, half the number of changes around the pixel (Rutovitz)."""


def binarize(enhanced: Floats, mask: Mask) -> Mask:
    """Return the positive pixels of an enhanced image in its mask, without specks or pores."""
    ridges = np.ascontiguousarray((enhanced > 0) & mask).view(np.uint8)
    flip_small_parts(ridges, 1, MIN_RIDGE_AREA_PX, corners=True)
    flip_small_parts(ridges, 0, MIN_HOLE_AREA_PX, corners=False)
    return ridges.view(np.bool_) & mask


def flip_small_parts(image: Grey, colour: int, min_area: int, *, corners: bool) -> None:
    """Invert, in place, the parts of value `colour` in a 0/1 image whose area is small.

    Parts of at least `min_area` pixels stay. Pixels are connected over edges, and with `corners`
    also over corners.
    """
    if not _small_parts_kernel.COMPILED:
        flip_with_opencv(image, colour, min_area, corners=corners)
        return
    height, width = image.shape
    runs = np.empty((height * ((width + 1) // 2), 5), np.int32)
    _small_parts_kernel.flip_small_parts(image, colour, min_area, int(corners), runs)


def flip_with_opencv(image: Grey, colour: int, min_area: int, *, corners: bool) -> None:
    """Invert as `flip_small_parts` does: the uncompiled path, and the kernel's oracle."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        (image == colour).view(np.uint8), connectivity=8 if corners else 4
    )
    small = stats[:, cv2.CC_STAT_AREA] < min_area
    small[0] = False
    image ^= small[labels].view(np.uint8)


def thin(binary: Mask) -> Mask:
    """Thin a binary image (H, W) to its skeleton, eight-connected and one pixel wide.

    Guo, Hall, "Parallel thinning with two-subiteration algorithms", CACM 32 (1989), algorithm A1;
    then every pixel that connection does not need is deleted, in raster order, until none is left.
    """
    image = np.pad(binary, 1).view(np.uint8)
    if not _thin_kernel.COMPILED:
        thin_with_skimage(image)
        return image[1:-1, 1:-1].astype(bool)
    height, width = image.shape
    packed = np.packbits(image, axis=1, bitorder="little")
    words = np.zeros((height, -(-width // WORD_BITS) + 2), np.uint64)
    inner = words.view(np.uint8)[:, 8 : 8 + packed.shape[1]]
    inner[:] = packed
    _thin_kernel.thin_words(words, np.zeros_like(words), np.zeros(height, np.int32))
    image[:] = np.unpackbits(inner, axis=1, count=width, bitorder="little")
    pixels = np.flatnonzero(image.view(np.bool_)).astype(np.int32)
    _thin_kernel.delete_simple_points(image, pixels, SIMPLE)
    return image[1:-1, 1:-1].astype(bool)


def thin_with_skimage(image: Grey) -> None:
    """Thin `image` (0/1, zero border) in place: the uncompiled path, and the kernel's oracle."""
    from skimage import morphology  # noqa: PLC0415  (imports scipy)

    image[:] = morphology.thin(image)  # type: ignore[no-untyped-call]
    pixels, width = np.flatnonzero(image), image.shape[1]
    code = dict(zip(pixels.tolist(), neighbour_bytes(image, pixels).tolist(), strict=True))
    simple, count = SIMPLE.tolist(), len(code) + 1
    while len(code) < count:
        count = len(code)
        for at in list(code):
            if simple[code[at]]:
                del code[at]
                for k, (dy, dx) in enumerate(AROUND):
                    if at + dy * width + dx in code:  # for it, this pixel lies opposite
                        code[at + dy * width + dx] &= ~(1 << (k + 4) % 8)
    image[:] = 0
    image.ravel()[list(code)] = 1


def neighbour_bytes(image: Grey, pixels: NDArray[np.intp]) -> Grey:
    """Return the neighbours of pixels of a 0/1 image (zero border) as bytes: bit k for neighbour k.

    `pixels` are flat indices.
    """
    flat, code = image.ravel(), np.zeros(len(pixels), np.uint8)
    for k, (dy, dx) in enumerate(AROUND):
        code |= flat.take(pixels + dy * image.shape[1] + dx) << k
    return code
