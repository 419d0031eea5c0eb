"""Thinning: ridges become a skeleton one pixel wide."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.image.skeleton import _thin_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.preprocess.arrays import Grey, Mask

WORD_BITS: Final = 64
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


def thin(binary: Mask) -> Mask:
    """Thin a binary image (H, W) to its skeleton, eight-connected and one pixel wide.

    Guo, Hall, "Parallel thinning with two-subiteration algorithms", CACM 32 (1989), algorithm A1;
    then every pixel that connection does not need is deleted, in raster order, until none is left.
    """
    image = bordered(binary)
    thin_in_place = thin_with_kernel if kernel.COMPILED else thin_with_skimage
    thin_in_place(image)
    return image[1:-1, 1:-1].astype(bool)


def bordered(binary: Mask) -> Grey:
    """Return a binary image as 0 and 1, with a border of zeros one pixel wide."""
    height, width = binary.shape
    image = np.zeros((height + 2, width + 2), np.uint8)
    image[1:-1, 1:-1] = np.asarray(binary, bool)
    return image


def thin_with_kernel(image: Grey) -> None:
    """Thin `image` (0/1, zero border) in place: the compiled path."""
    height, width = image.shape
    packed = np.packbits(image, axis=1, bitorder="little")
    words = np.zeros((height, -(-width // WORD_BITS) + 2), np.uint64)
    inner = words.view(np.uint8)[:, 8 : 8 + packed.shape[1]]
    inner[:] = packed
    kernel.thin_words(words, np.zeros_like(words), np.zeros(height, np.int32))
    image[:] = np.unpackbits(inner, axis=1, count=width, bitorder="little")
    pixels = np.flatnonzero(image.view(np.bool_)).astype(np.int32)
    kernel.delete_simple_points(image, pixels, SIMPLE)


def thin_with_skimage(image: Grey) -> None:
    """Thin `image` (0/1, zero border) in place: the uncompiled path, and the kernel's oracle."""
    from skimage import morphology  # noqa: PLC0415  (imports scipy)

    image[:] = morphology.thin(image)  # type: ignore[no-untyped-call]
    pixels, around = np.flatnonzero(image), neighbours(image.shape[1])
    code = dict(zip(pixels.tolist(), neighbour_bytes(image, pixels).tolist(), strict=True))
    simple, count = SIMPLE.tolist(), len(code) + 1
    while len(code) < count:
        count = len(code)
        for at in list(code):
            if simple[code[at]]:
                del code[at]
                for k, step in enumerate(around):
                    if at + step in code:
                        code[at + step] &= ~(1 << (k + 4) % 8)  # for it, this pixel lies opposite
    image[:] = 0
    image.ravel()[list(code)] = 1


def neighbours(width: int) -> tuple[int, ...]:
    """Return the flat steps to the neighbours of a pixel, counter-clockwise from east."""
    return 1, 1 - width, -width, -1 - width, -1, width - 1, width, width + 1


def neighbour_bytes(image: Grey, pixels: NDArray[np.intp]) -> Grey:
    """Return the neighbours of pixels of a 0/1 image (zero border) as bytes: bit k for neighbour k.

    `pixels` are flat indices.
    """
    flat, code = image.ravel(), np.zeros(len(pixels), np.uint8)
    for k, step in enumerate(neighbours(image.shape[1])):
        code |= flat.take(pixels + step) << k
    return code
