"""Thinning: ridges become a skeleton one pixel wide."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.skeleton import _thin_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

WORD_BITS: Final = 64


def thin(binary: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Thin a binary image (H, W) to its skeleton, eight-connected and one pixel wide.

    References
    ----------
    Guo, Hall, "Parallel thinning with two-subiteration algorithms", CACM 32 (1989), algorithm A1;
    then every pixel that connection does not need is deleted, in raster order, until none is left.

    Examples
    --------
    >>> bar = np.zeros((9, 20), bool)
    >>> bar[3:6, 2:18] = True
    >>> np.flatnonzero(thin(bar).any(axis=1)).tolist()
    [4]
    """
    image = bordered(binary)
    if kernel.COMPILED:
        thin_with_kernel(image)
    else:
        thin_with_numpy(image)
    return image[1:-1, 1:-1].astype(bool)


def bordered(binary: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return a binary image as 0 and 1, with a border of zeros one pixel wide."""
    height, width = binary.shape
    image = np.zeros((height + 2, width + 2), np.uint8)
    image[1:-1, 1:-1] = np.asarray(binary, bool)
    return image


def thin_with_kernel(image: NDArray[np.uint8]) -> None:
    """Thin `image` (0/1, zero border) in place: the compiled path."""
    height, width = image.shape
    packed = np.packbits(image, axis=1, bitorder="little")
    words = np.zeros((height, -(-width // WORD_BITS) + 2), np.uint64)
    inner = words.view(np.uint8)[:, 8 : 8 + packed.shape[1]]
    inner[:] = packed
    kernel.thin_words(words, np.zeros_like(words), np.zeros(height, np.int32))
    image[:] = np.unpackbits(inner, axis=1, count=width, bitorder="little")
    pixels = np.flatnonzero(image.view(np.bool_)).astype(np.int32)
    kernel.delete_simple_points(image, pixels, simple_table())


def thin_with_numpy(image: NDArray[np.uint8]) -> None:
    """Thin `image` (0/1, zero border) in place: the uncompiled path, and the kernel's oracle."""
    changed = True
    while changed:
        changed = False
        for table in guo_hall_table():
            deleted = (image > 0) & (table[neighbour_code(image)] > 0)
            image[deleted] = 0
            changed |= bool(deleted.any())
    simple = simple_table()
    flat = image.ravel()
    width = image.shape[1]
    ring = [1, 1 - width, -width, -1 - width, -1, width - 1, width, width + 1]
    changed = True
    while changed:
        changed = False
        for at in np.flatnonzero(flat).tolist():
            if simple[sum(int(flat[at + step]) << k for k, step in enumerate(ring))]:
                flat[at] = 0
                changed = True


def neighbour_code(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the eight neighbours of each pixel of a 0/1 image as a byte.

    Bits 0..7: east, north-east, north, north-west, west, south-west, south, south-east; pixels
    outside count as 0.
    """
    weights = np.array([[8, 4, 2], [16, 0, 1], [32, 64, 128]], np.float32)
    code = cv2.filter2D(image, cv2.CV_8U, weights, borderType=cv2.BORDER_CONSTANT)
    return np.asarray(code, np.uint8)


@cache
def guo_hall_table() -> NDArray[np.uint8]:
    """Return, for each sub-iteration and neighbour byte, whether Guo and Hall delete the pixel."""
    table = np.zeros((2, 256), np.uint8)
    for code in range(256):
        n = [bool(code >> k & 1) for k in range(8)]
        east, north_east, north, north_west, west, south_west, south, south_east = n
        crossings = sum(not n[k] and (n[(k + 1) % 8] or n[(k + 2) % 8]) for k in (0, 2, 4, 6))
        pairs_1 = sum(n[k] or n[(k + 1) % 8] for k in (1, 3, 5, 7))
        pairs_2 = sum(n[k] or n[(k + 1) % 8] for k in (0, 2, 4, 6))
        if crossings == 1 and 2 <= min(pairs_1, pairs_2) <= 3:
            table[0, code] = not ((north or north_east or not south_east) and east)
            table[1, code] = not ((south or south_west or not north_west) and west)
    return table


@cache
def simple_table() -> NDArray[np.uint8]:
    """Return, for each neighbour byte, whether the pixel is no end and not needed to connect.

    That is: at least two neighbours, all in one eight-connected part, and a background neighbour
    to the east, north, west or south (so that no hole is made).
    """
    table = np.zeros(256, np.uint8)
    for code in range(256):
        n = [bool(code >> k & 1) for k in range(8)]
        crossings = sum(not n[k] and (n[(k + 1) % 8] or n[(k + 2) % 8]) for k in (0, 2, 4, 6))
        table[code] = crossings == 1 and sum(n) >= 2
    return table


@cache
def crossing_number_table() -> NDArray[np.uint8]:
    """Return, for each neighbour byte, the crossing number: half the changes around the pixel."""
    codes = np.arange(256)
    bits = codes[:, None] >> np.arange(8) & 1
    changes = np.abs(bits - np.roll(bits, 1, axis=1)).sum(axis=1)
    return np.asarray(changes // 2, np.uint8)
