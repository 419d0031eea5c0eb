"""Thinning: ridges become a skeleton one pixel wide."""

from __future__ import annotations

from functools import cache
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.skeleton import _thin_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.preprocess.arrays import Grey, Mask

WORD_BITS: Final = 64


def thin(binary: Mask) -> Mask:
    """Thin a binary image (H, W) to its skeleton, eight-connected and one pixel wide.

    Guo, Hall, "Parallel thinning with two-subiteration algorithms", CACM 32 (1989), algorithm A1;
    then every pixel that connection does not need is deleted, in raster order, until none is left.
    """
    image = bordered(binary)
    thin_in_place = thin_with_kernel if kernel.COMPILED else thin_with_numpy
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
    kernel.delete_simple_points(image, pixels, simple_table())


def thin_with_numpy(image: Grey) -> None:
    """Thin `image` (0/1, zero border) in place: the uncompiled path, and the kernel's oracle."""
    left = image.size + 1
    while (count := int(np.count_nonzero(image))) < left:
        left = count
        for table in guo_hall_table():
            image[(image > 0) & (table[neighbour_code(image)] > 0)] = 0
    simple = simple_table().tobytes()
    flat = image.ravel()
    code = bytearray(neighbour_code(image))
    width = image.shape[1]
    ring = [1, 1 - width, -width, -1 - width, -1, width - 1, width, width + 1]
    # in raster order; a deletion can make only the pixels around it simple: those before it are
    # visited in the next pass
    passed = np.flatnonzero((image > 0) & (simple_table()[neighbour_code(image)] > 0)).tolist()
    while visited := passed:
        passed = []
        heapify(visited)
        while visited:
            at = heappop(visited)
            if not (flat[at] and simple[code[at]]):
                continue
            flat[at] = 0
            for k, step in enumerate(ring):
                beside = at + step
                code[beside] &= ~(1 << (k + 4) % 8)  # for it, this pixel lies opposite
                if flat[beside] and simple[code[beside]]:
                    heappush(visited if step > 0 else passed, beside)


def neighbour_code(image: Grey) -> Grey:
    """Return the neighbours of each pixel of a 0/1 image as a byte, counter-clockwise from east."""
    weights = np.array([[8, 4, 2], [16, 0, 1], [32, 64, 128]], np.float32)
    return np.asarray(
        cv2.filter2D(image, cv2.CV_8U, weights, borderType=cv2.BORDER_CONSTANT), np.uint8
    )


@cache
def _neighbour_bits() -> Mask:
    """Return the eight neighbours of each byte of neighbours, shape (8, 256), from the east."""
    return np.asarray(np.arange(256) >> np.arange(8)[:, None] & 1, bool)


@cache
def guo_hall_table() -> Grey:
    """Return, for each sub-iteration and neighbour byte, whether Guo and Hall delete the pixel."""
    n = _neighbour_bits()
    either = n | np.roll(n, -1, axis=0)  # neighbour k or the next
    pairs = np.minimum(either[1::2].sum(axis=0), either[::2].sum(axis=0))
    deletable = (_crossings() == 1) & (pairs >= 2) & (pairs <= 3)
    east, north_east, north, north_west, west, south_west, south, south_east = n
    first = ~((north | north_east | ~south_east) & east)
    second = ~((south | south_west | ~north_west) & west)
    return np.asarray(deletable & [first, second], np.uint8)


@cache
def simple_table() -> Grey:
    """Return, for each neighbour byte, whether the pixel is no end and not needed to connect.

    That is: at least two neighbours, all in one eight-connected part, and a background neighbour
    to the east, north, west or south (so that no hole is made).
    """
    return np.asarray((_crossings() == 1) & (_neighbour_bits().sum(axis=0) >= 2), np.uint8)


def _crossings() -> NDArray[np.intp]:
    """Return the eight-connected parts of each neighbour byte; 0 without background at an edge."""
    n = _neighbour_bits()
    starts = ~n[::2] & (n[1::2] | np.roll(n, -2, axis=0)[::2])
    return np.asarray(starts.sum(axis=0), np.intp)


@cache
def crossing_number_table() -> Grey:
    """Return, for each neighbour byte, half the number of changes around the pixel (Rutovitz)."""
    n = _neighbour_bits()
    return np.asarray((n ^ np.roll(n, 1, axis=0)).sum(axis=0) // 2, np.uint8)
