"""The phase of the ridges of fingers on a coarse lattice, and the minutiae in it.

The height of the ridges at a point is the cosine of a phase, which advances by a turn from ridge to
ridge. The phase grows from node to node by the advance that ridge orientation and period demand,
with some noise, and is then relaxed; it keeps vortices, around which it advances by a turn: there a
ridge begins. These are the minutiae.

References
----------
Larkin, Fletcher, "A coherent framework for fingerprint analysis: are fingerprints holograms?",
Optics Express 15 (2007): the amplitude and frequency model.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from research.templates.numbers import TURN, angle_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from research.templates.numbers import Doubles, Floats, Ints

    Mask = NDArray[np.bool_]

STEP_PX: Final = 10.0  # from node to node of the lattice
LEVEL: Final = 16  # of orientations, so that rounding differs on no machine
SPACING: Final = 0.9  # ridge periods between two minutiae
MOST_MINUTIAE: Final = 256  # of a finger
AHEAD: Final = ((0, 1), (1, 1), (1, 0), (1, -1))  # nodes right, and right, under and left below
_FAINT: Final = 1e-6  # against unit vectors
_LEAST: Final = np.float32(1e-20)
_SHIFT: Final = np.float32(1024)  # of turns, above zero
_SINE_OF_HALF: Final = (3.1415800, -5.1671200, 2.5417800, -0.5540850)
_LEVELS: Final = np.arange(TURN // 2 // LEVEL) * (2 * np.pi * LEVEL / TURN)
_COSINE, _SINE = np.cos(_LEVELS).astype(np.float32), np.sin(_LEVELS).astype(np.float32)
_COARSE: Final = np.arange(TURN // 64) * (2 * np.pi * 64 / TURN)
COARSE_SINE: Final = np.sin(_COARSE).astype(np.float32)  # by angles over 64
_COARSE_COSINE: Final = np.cos(_COARSE).astype(np.float32)


class Links(NamedTuple):
    """The advance of the phase from each node to those `AHEAD`: four, of padded lattices each.

    A padded lattice has a border of one node on each side: (R + 2, C + 2, B).
    """

    cosine: Floats
    sine: Floats
    sign: Floats  # of the other node's normal, against this one's
    turns: Floats


def link_nodes(level: Ints, period: Floats, inside: Mask) -> Links:
    """Return the links of B lattices, (R, C, B), whose nodes of the finger are `inside`."""
    size = level.shape[0] + 2, level.shape[1] + 2, level.shape[2]
    middle = slice(1, -1), slice(1, -1)
    normal = np.zeros((2, *size), np.float32)
    across = inside.astype(np.float32) / period
    normal[(0, *middle)] = -_SINE[level // LEVEL] * across
    normal[(1, *middle)] = -_COSINE[level // LEVEL] * across  # y down
    links = Links(*(np.zeros((4, *size), np.float32) for _ in range(4)))
    for k, (down, right) in enumerate(AHEAD):
        here = slice(0, size[0] - 1), slice(1, size[1] - 1)
        there = slice(down, size[0] - 1 + down), slice(1 + right, size[1] - 1 + right)
        (x, y), (ox, oy) = normal[(slice(None), *here)], normal[(slice(None), *there)]
        sign = np.where(x * ox + y * oy >= 0, np.float32(1), np.float32(-1))
        half = np.float32(0.5 * STEP_PX)
        turns = (x + sign * ox) * (half * right) + (y + sign * oy) * (half * down)
        shifted = turns + _SHIFT
        cosine, sine = _unit(shifted - np.floor(shifted + np.float32(0.5)))
        for part, values in zip(links, (cosine, sine, sign, turns), strict=True):
            part[(k, *here)] = values
    return links


def _unit(turns: Floats) -> tuple[Floats, Floats]:
    """Return cosine and sine of -1/2 to 1/2 turns, to 1e-5."""
    a, b, c, d = (np.float32(value) for value in _SINE_OF_HALF)
    one, two = np.float32(1), np.float32(2)
    u = turns * turns
    h = turns * (a + u * (b + u * (c + u * d)))
    root = np.sqrt(np.abs(one - h * h))
    return np.asarray(one - two * h * h), np.asarray(two * h * root)


def grow_phase(links: Links, inside: Mask, start: Floats, swing: Floats) -> Floats:
    """Grow and relax the phase as unit vectors (2, R, C, B).

    Row by row, the phase at a node is the mean of what the nodes before demand, turned by `swing`
    (R, C, B) in turns, or by `start` (B,) where there are none. From the end to the beginning, it
    then becomes the mean of what all eight around demand. All nodes (i, j) of equal 2 i + j are
    independent of each other, and are set at once: the arrays are sorted by it.
    """
    rows, columns, lanes = inside.shape
    wide = columns + 2
    i, j = np.divmod(np.arange((rows + 2) * wide), wide)
    order = np.lexsort((i, 2 * i + j))
    at = np.empty(len(order), np.intp)
    at[order] = np.arange(len(order))
    # to a node, and back
    turning = np.empty((4, 2, len(order), lanes), np.float32)
    crossing = np.empty_like(turning)
    for k in range(4):
        cosine, sine, sign = (part[k].reshape(-1, lanes)[order] for part in links[:3])
        turning[k] = cosine, sign * cosine
        crossing[k] = -sine, sign * sine
    padded = np.zeros((3, rows + 2, wide, lanes), np.float32)
    padded[0, 1:-1, 1:-1] = inside
    padded[1:, 1:-1, 1:-1] = _unit(swing)
    kept, cosine, sine = padded.reshape(3, -1, lanes)[:, order]
    wave = np.zeros((2, len(order), lanes), np.float32)
    turned = np.stack([np.cos(2 * np.pi * start), np.sin(2 * np.pi * start)])
    first = (_FAINT * turned).astype(np.float32)[:, None]
    fronts = range(3, 2 * rows + columns + 1)
    for backwards in (False, True):
        for front in reversed(fronts) if backwards else fronts:
            low, high = max(1, -(-(front - columns) // 2)), min(rows, (front - 1) // 2)
            begin, count = int(at[low * wide + front - 2 * low]), high - low + 1
            here = slice(begin, begin + count)
            total = np.repeat(first, count, axis=1)
            for k, (down, right) in enumerate(AHEAD):
                node = int(at[(low - down) * wide + front - 2 * low - right])
                before = slice(node, node + count)
                total += wave[:, before] * turning[k, :, before] + (
                    wave[::-1, before] * crossing[k, :, before]
                )
            for k, (down, right) in enumerate(AHEAD if backwards else ()):
                node = int(at[(low + down) * wide + front - 2 * low + right])
                after = wave[:, node : node + count]
                total += after * turning[k, :, here] + after[::-1] * crossing[k, ::-1, here]
            x, y = total
            total *= kept[here] / np.sqrt(x * x + y * y + _LEAST)
            if not backwards:
                c, s = cosine[here], sine[here]
                total = np.stack([x * c - y * s, x * s + y * c])
            wave[:, here] = total
    return wave[:, at].reshape(2, rows + 2, wide, lanes)[:, 1:-1, 1:-1]


def find_minutiae(
    level: Ints, period: Floats, inside: Mask, links: Links, phase: Ints, place: Floats
) -> list[Doubles]:
    """Return the vortices of the phase of each lattice as x, y and direction, (M, 3), row by row.

    Lattices are (B, R, C); `place` (B, R, C, 2), 0 to 1, is where in its square a vortex lies. Of
    two minutiae nearer than `SPACING` periods none is kept.
    """
    turns, sign = (
        np.moveaxis(part[::2, 1:-1, 1:-1], -1, 1).astype(np.float64)
        for part in (links.turns, links.sign)
    )
    advance = np.zeros_like(turns)  # to the node at the right, and under it
    for k, there in enumerate((np.roll(phase, -1, axis=2), np.roll(phase, -1, axis=1))):
        rest = (sign[k] * there - phase) * (1.0 / TURN) - turns[k]
        advance[k] = turns[k] + rest - np.floor(rest + 0.5)
    right, down = advance
    top, left = sign
    around = down[:, :-1, :-1] + left[:, :-1, :-1] * right[:, 1:, :-1]
    around -= top[:, :-1, :-1] * down[:, :-1, 1:] + right[:, :-1, :-1]
    charge = np.floor(around + 0.5)
    one_way = top[:, :-1, :-1] * left[:, :-1, 1:] == left[:, :-1, :-1] * top[:, 1:, :-1]
    square = inside[:, :-1, :-1] & inside[:, :-1, 1:] & inside[:, 1:, :-1] & inside[:, 1:, 1:]
    b, i, j = np.nonzero(square & one_way & (charge != 0))  # no singular point
    corners = [level[b, i + down, j + right] >> 6 for down, right in ((0, 0), (0, 1), (1, 0))]
    corners.append(level[b, i + 1, j + 1] >> 6)
    cosine, sine = (
        table.astype(np.float64)[np.array(corners)] for table in (_COARSE_COSINE, COARSE_SINE)
    )
    flipped = np.where(cosine[0] * cosine + sine[0] * sine > 0, 1.0, -1.0)
    flipped[0] = 1.0
    x, y = ((((f[0] + f[1]) + f[2]) + f[3]) for f in (flipped * cosine, flipped * sine))
    direction = angle_of(y * charge[b, i, j], x * charge[b, i, j])
    across, along = (
        (node.astype(np.float32) + place[b, i, j, axis]).astype(np.float64) * STEP_PX
        for axis, node in enumerate((j, i))
    )
    row, column = ((place / STEP_PX).astype(np.intp) for place in (along, across))
    reach = SPACING * period[b, row, column].astype(np.float64)
    made = np.column_stack([across, along, direction])
    ends = np.searchsorted(b, np.arange(len(level) + 1))
    return [
        _thinned(made[begin:end][:MOST_MINUTIAE], reach[begin:end][:MOST_MINUTIAE])
        for begin, end in pairwise(ends)
    ]


def _thinned(minutiae: Doubles, reach: Doubles) -> Doubles:
    """Leave out minutiae with another within their reach, the earlier and its first together."""
    x, y = minutiae[:, :2].T
    near = np.square(x - x[:, None]) + np.square(y - y[:, None]) < np.square(reach)[:, None]
    kept = np.ones(len(minutiae), bool)
    for one, other in zip(*np.nonzero(np.triu(near, 1)), strict=True):
        if kept[one] and kept[other]:
            kept[[one, other]] = False
    return minutiae[kept]
