"""Ridge images of eight bits a cell: every eighth bit, and the others estimated from them.

Of the 8 by 8 bits of a cell (see `RidgeField`), every other row is kept, and in it every fourth
bit, by turns: the bits at which a comparison samples one of the prints. The others are the sign of
a weighted sum of the samples around them. The weights follow a wave across the ridge orientation of
the cell, which fades with distance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.gallery.index.prints._ridge_sample_kernel import restore
from fpmatch.matching.constants.comparison import FEW_SAMPLES

if TYPE_CHECKING:
    from numpy.typing import NDArray

ORIENTATIONS: Final = 16  # in half a turn
SIDE: Final = 8  # bits along a cell
HALF: Final = 4  # samples of a cell's upper or lower half
_OUTSIDE: Final = 16  # a half that is not known
_LARGEST: Final = 127  # the sum of the weights of a bit, without their signs


@dataclass(frozen=True, slots=True)
class RidgeSampleParameters:
    """Set the weights by which bits are estimated; lengths in bits, two pixels at 500 dpi each."""

    period: float = 4.4  # of the wave
    along: float = 3.0  # standard deviation of how the weights fade along the ridges,
    across: float = 2.0  # and across them


def sample_ridges(ridges: NDArray[np.uint64]) -> NDArray[np.uint8]:
    """Return the samples of ridge images (N,), the first of them lowest.

    Examples
    --------
    >>> sample_ridges(np.array([0, 2**64 - 1, 1 << 9], np.uint64)).tolist()
    [0, 255, 1]
    """
    rows = ridges.astype("<u8").view(np.uint8).reshape(-1, SIDE)[:, 1::2]
    pairs = _pairs()[np.arange(HALF), rows]
    return np.asarray(pairs[:, 0] | pairs[:, 1] << 2 | pairs[:, 2] << 4 | pairs[:, 3] << 6)


def spread_samples(samples: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Return ridge images (N,) that show the samples (N,), and a valley everywhere else.

    Examples
    --------
    >>> sample_ridges(spread_samples(np.array([0, 3, 255], np.uint8))).tolist()
    [0, 3, 255]
    """
    return _spread()[samples]


def restore_ridges(
    samples: NDArray[np.uint8], orientation: NDArray[np.uint8], mask: NDArray[np.bool_]
) -> NDArray[np.uint64]:
    """Return the ridge images of the cells of a mask (rows, columns), 0 outside.

    Of the cells inside the mask, row by row, there are the samples (N,) and the ridge orientation
    (N,) in 16ths of half a turn.
    """
    start, shape = np.array((0, mask.size), np.int64), np.array((mask.shape,), np.int32)
    inside = np.ascontiguousarray(mask).view(np.uint8).ravel()
    return restore_all(samples, orientation, inside, start, shape).reshape(mask.shape)


def restore_all(
    samples: NDArray[np.uint8],
    orientation: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    start: NDArray[np.int64],
    shape: NDArray[np.int32],
) -> NDArray[np.uint64]:
    """Return the ridge images of the cells of many prints, 0 where `mask` is.

    Print k has the cells from ``start[k]`` to ``start[k + 1]``, row by row; ``shape[k]`` begins
    with rows and columns. `samples` and `orientation` are those of cells inside, as above.
    """
    room = int(((shape[:, 0] + 2) * (shape[:, 1] + 2)).max(initial=0))
    ridges, halves = np.zeros(len(mask), np.uint64), np.empty(2 * room, np.uint8)
    looked_up = _looked_up().copy()
    restore(samples, orientation, mask, start, shape, looked_up, _table(), halves, ridges)
    return ridges


@cache
def _pairs() -> NDArray[np.uint8]:
    """Return the two samples in a byte, for each of the sampled rows, shape (4, 256)."""
    pairs = np.empty((HALF, 256), np.uint8)
    for k in range(HALF):
        first, second = (column for row, column in FEW_SAMPLES if row == 2 * k + 1)
        byte = np.arange(256)
        pairs[k] = (byte >> first & 1) | (byte >> second & 1) << 1
    return pairs


@cache
def _spread() -> NDArray[np.uint64]:
    """Return what `spread_samples` makes of each byte, shape (256,)."""
    place = np.array([SIDE * row + column for row, column in FEW_SAMPLES], np.uint64)
    bits = np.arange(256, dtype=np.uint64)[:, None] >> np.arange(len(place), dtype=np.uint64) & 1
    words: NDArray[np.uint64] = (bits << place).sum(axis=1, dtype=np.uint64)
    return words


@cache
def _looked_up() -> NDArray[np.int64]:
    """Return which halves of the cells around a cell are looked up: half, row, column, plus one.

    The farther halves of those above and below are left out. A fourth column is for the kernel.
    """
    halves = [
        (half, row, column, 0)
        for row in range(3)
        for column in range(3)
        for half in range(2)
        if (row, half) not in {(0, 0), (2, 1)}
    ]
    return np.array(halves, np.int64)


@cache
def _table() -> NDArray[np.uint64]:
    """Return what each value of each half says of the bits of a cell, in rows of eight bytes.

    The shape is (16 orientations, 12 halves, 17 values, 8 rows). All bytes are positive, and their
    sum over the halves is 128 and more where the bit is set, at most 255.
    """
    weight = _weights()  # of orientation, half, sample of it, row, column
    sign = np.where(np.arange(1 << HALF)[:, None] >> np.arange(HALF) & 1, 1, -1)
    most = np.abs(weight).sum(axis=2)
    table = np.repeat(most[:, :, None], _OUTSIDE + 1, axis=2)
    table[:, :, :_OUTSIDE] += np.einsum("hi,okiyx->okhyx", sign, weight)
    table[:, _own()[0]] += (_LARGEST + 1 - most.sum(axis=1))[:, None]
    words: NDArray[np.uint64] = table.astype(np.uint8).view("<u8")[..., 0].astype(np.uint64)
    return np.ascontiguousarray(words)


def _weights() -> NDArray[np.int64]:
    """Return the weights of samples, shape (16, 12, 4, 8, 8); a sample's own bit is its own."""
    p = RidgeSampleParameters()
    sample = np.array(FEW_SAMPLES).reshape(2, HALF, 2)
    half, row, column, _ = _looked_up().T
    place = sample[half] + SIDE * (np.stack([row, column], axis=1)[:, None] - 1)
    y, x = np.mgrid[:SIDE, :SIDE]
    dy, dx = place[:, :, 0, None, None] - y, place[:, :, 1, None, None] - x
    angle = (np.arange(ORIENTATIONS) * (np.pi / ORIENTATIONS))[:, None, None, None, None]
    along = dx * np.cos(angle) - dy * np.sin(angle)
    across = dx * np.sin(angle) + dy * np.cos(angle)
    weight = np.cos(2 * np.pi / p.period * across)
    weight *= np.exp(-0.5 * ((along / p.along) ** 2 + (across / p.across) ** 2))
    y, x = np.array(FEW_SAMPLES).T
    weight[..., y, x] = 0.0
    for k, own in enumerate(_own()):
        for i, (row, column) in enumerate(sample[k].tolist()):
            weight[:, own, i, row, column] = 1.0
    weight *= _LARGEST / np.abs(weight).sum(axis=(1, 2), keepdims=True)
    return np.asarray(np.trunc(weight), np.int64)


def _own() -> list[int]:
    """Return where the two halves of the cell itself are looked up."""
    return [k for k, (_, *cell, _) in enumerate(_looked_up().tolist()) if cell == [1, 1]]
