"""Signs of several prints in one template, which would match all of their fingers.

The ridges of one print continue over its whole area, its minutiae lie along them, and neighbouring
minutiae have similar directions. The limits are chosen so that at most one print in a thousand has
a sign.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.gallery.listing.separate_prints import (
    coarse,
    count_loops,
    count_prints,
    doubled_orientation,
)
from fpmatch.templates import plausibility
from fpmatch.templates.minutiae import STANDARD_DPI
from fpmatch.templates.plausibility import best_minutiae, dpi_meant

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

    Floats = NDArray[np.float64]

# A sign is a measure beyond its limit; lengths are pixels at 500 dpi.
MIN_BREAK: Final = 0.53  # of the ridges along a line
MAX_NECK: Final = 0.3  # width of the ridges at a line, in sides of a square as large as a part
MOST_LOOPS: Final = 2  # and deltas
MIN_ACROSS: Final = 5  # minutiae across the ridges, and
MIN_ACROSS_SHARE: Final = 0.08
MIN_CONTRARY_SHARE: Final = 0.52  # of minutiae, with a neighbour of a contrary direction
MIN_GAP_PX: Final = 110.0  # strip between two groups of minutiae, where no ridges are known

DIRECTIONS: Final = 24  # of lines
_PER_CELL: Final = 2  # lines of one direction
_MIN_PART: Final = 0.2  # of the cells of a print, on either side of a line
_MIN_CROSSED: Final = 6  # pairs of cells
_EVEN_PAIRS: Final = 8  # without a break, that are added to the crossed ones: few weigh little
_FULL_TURN: Final = 0.15  # squared sine of a turn of the ridges that counts as a whole break
_PICTURES: Final = 2.0  # weight of the difference of pictures
_LEAST_MEAN: Final = 0.2  # length of the mean turn from which it is one
_CERTAIN: Final = 0.6  # length of a mean of unit vectors from which an orientation is certain
_ADDED: Final = 8  # minutiae without a sign, that are added: few weigh little
_ACROSS: Final = 0.2  # squared sine of the angle between a minutia and the ridges
_CONTRARY: Final = 0.6  # of the angle between two minutiae
_NEIGHBOUR_PX: Final = 48.0
_MIN_GROUP: Final = 8  # minutiae


class _Bits(NamedTuple):
    """Where the bits of a picture lie: in all lines but the last, and in the first."""

    next: np.uint64  # from a line to the next
    not_last: np.uint64
    last: np.uint64  # from the first line to the last
    first: np.uint64


_ROWS: Final = _Bits(*map(np.uint64, (8, 0x00FF_FFFF_FFFF_FFFF, 56, 0xFF)))
_COLUMNS: Final = _Bits(*map(np.uint64, (1, 0x7F7F_7F7F_7F7F_7F7F, 7, 0x0101_0101_0101_0101)))
_DOWN, _RIGHT = np.array([1, 0]), np.array([0, 1])
_ONES: Final = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1).sum(1, dtype=np.uint8)


def why_two_prints(template: Template) -> str:
    """Return why a template probably has the prints of two fingers; "" where nothing indicates it.

    Minutiae alone show it less often than minutiae with ridges.
    """
    px = STANDARD_DPI / (dpi_meant(template) or template.dpi)
    m, field = template.minutiae, coarse(template.field)
    signs, number = [], count_prints(template)
    if field is not None and field.mask.any():
        neck, most = neck_and_break(field)
        across, share = minutiae_across(m, field)
        many = "two" if number <= 2 else str(number)
        signs += [f"the ridges have {many} areas"] * (neck < MAX_NECK or number > 1)
        signs += ["the ridges break off along a line"] * (most > MIN_BREAK)
        signs += ["more than two loops or deltas"] * (max(count_loops(field)) > MOST_LOOPS)
        signs += ["minutiae lie across the ridges"] * (
            across >= MIN_ACROSS and share > MIN_ACROSS_SHARE
        )
    elif widest_gap(m, px) > MIN_GAP_PX:
        signs.append("the minutiae form two groups")
    if contrary_share(m, px) > MIN_CONTRARY_SHARE:
        signs.append("neighbouring minutiae have contrary directions")
    if number <= 1:
        return f"probably two prints in one: {', '.join(signs)}" if signs else ""
    return f"probably {many} prints in one: {', '.join(signs)}; cut them into one image each"


def find_doubts(template: Template) -> tuple[str, ...]:
    """Return the doubts of `fpmatch.templates.plausibility`, and why there are probably two prints.

    There are none for most prints.
    """
    return tuple(filter(None, (*plausibility.find_doubts(template), why_two_prints(template))))


def neck_and_break(field: RidgeField) -> tuple[float, float]:
    """Return how narrow the print is where it is narrowest, and how far its ridges break off.

    Both are those of the straight line where they are most, among lines with a large part of the
    print on either side. Ridges break off where they turn otherwise across the line than beside it,
    and where their pictures differ more than elsewhere.
    """
    cells = np.argwhere(field.mask)
    ends, breaks = _breaks(field)
    one, other = _lines_beyond(ends[0]), _lines_beyond(ends[1])
    beyond = _lines_beyond(cells)
    first = int(beyond.min())
    lines = int(beyond.max()) - first + 1

    def sums(place: NDArray[np.intp], values: Floats) -> Floats:
        """Return, for each direction and line, the sum of the values up to it."""
        flat = place - first + lines * np.arange(DIRECTIONS)[:, None]
        weights = np.broadcast_to(values, flat.shape).ravel()
        each = np.bincount(flat.ravel(), weights, DIRECTIONS * lines)
        return each.reshape(DIRECTIONS, lines).cumsum(axis=1)

    near, far = np.minimum(one, other), np.maximum(one, other)
    all_pairs = np.ones(len(breaks))
    crossed = sums(near, all_pairs) - sums(far, all_pairs)
    broken = sums(near, breaks) - sums(far, breaks)
    part = sums(beyond, np.ones(len(cells)))
    part = np.minimum(part, len(cells) - part)
    large = part > _MIN_PART * len(cells)
    neck = (crossed[large] / np.sqrt(part[large])).min(initial=np.inf)
    wide = large & (crossed >= _MIN_CROSSED)
    return float(neck), float((broken[wide] / (crossed[wide] + _EVEN_PAIRS)).max(initial=0.0))


def minutiae_across(m: Minutiae, field: RidgeField) -> tuple[int, float]:
    """Return how many minutiae lie across the ridges, and their share where these are certain."""
    vectors = np.pad(doubled_orientation(field), ((0, 1), (0, 1)))
    y, x = (
        np.clip(np.clip(place, 0, side * field.step) / field.step - 0.5, 0, side - 1)
        for place, side in zip(np.array([m.y, m.x], float), field.mask.shape, strict=True)
    )
    i, j = y.astype(np.intp), x.astype(np.intp)
    u, v = y - i, x - j
    mean = (1 - u) * ((1 - v) * vectors[i, j] + v * vectors[i, j + 1])
    mean += u * ((1 - v) * vectors[i + 1, j] + v * vectors[i + 1, j + 1])
    length = np.abs(mean)
    certain = length > _CERTAIN
    along = (mean * np.exp(-2j * m.angle)).real[certain] / length[certain]
    count = int(np.count_nonzero((1 - along) / 2 > _ACROSS))
    return count, count / (len(along) + _ADDED)


def contrary_share(m: Minutiae, px: float) -> float:
    """Return the share of minutiae with a neighbour whose direction is contrary to theirs.

    A pixel of the print has `px` pixels at 500 dpi.
    """
    m = best_minutiae(m)
    x, y, angle = (column.astype(np.float64) for column in (m.x, m.y, m.angle))
    near = np.hypot(x[:, None] - x, y[:, None] - y) * px < _NEIGHBOUR_PX
    contrary = np.sin(angle[:, None] - angle) ** 2 > _CONTRARY
    return float(np.count_nonzero((near & contrary).any(axis=1)) / (len(m) + _ADDED))


def widest_gap(m: Minutiae, px: float) -> float:
    """Return the width of the widest straight strip between two groups of minutiae."""
    if len(m) < 2 * _MIN_GROUP:
        return 0.0
    sine, cosine = _directions()
    place = np.sort(sine * m.x + cosine * m.y, axis=1)[:, _MIN_GROUP - 1 : 1 - _MIN_GROUP]
    return float(np.diff(place, axis=1).max()) * px


def _directions() -> tuple[Floats, Floats]:
    """Return sine and cosine of the directions of lines, (24, 1) each."""
    turn = np.arange(DIRECTIONS)[:, None] * (np.pi / DIRECTIONS)
    return np.sin(turn), np.cos(turn)


def _lines_beyond(cells: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the first line beyond each cell (N, 2), in each direction: (24, N)."""
    sine, cosine = _directions()
    place = sine * cells[:, 1] + cosine * cells[:, 0]
    return np.ceil(_PER_CELL * place + 1e-6).astype(np.intp)


def _breaks(field: RidgeField) -> tuple[NDArray[np.intp], Floats]:
    """Return the cells of each pair of neighbours, (2, P, 2), and how far its ridges break off."""
    mask, vectors = field.mask, doubled_orientation(field)
    pictures = np.zeros(mask.shape, np.uint64) if field.ridges is None else field.ridges
    upper, *below = _breaks_below(mask, vectors, pictures, _ROWS)
    left, *beside = _breaks_below(mask.T, vectors.T, pictures.T, _COLUMNS)
    left = left[:, ::-1]
    ends = np.stack([np.concatenate([upper, left]), np.concatenate([upper + _DOWN, left + _RIGHT])])
    turn, difference = (np.concatenate(both) for both in zip(below, beside, strict=True))
    usual = difference.mean() if len(difference) else 0.0
    return ends, np.minimum(turn / _FULL_TURN, 1.0) + _PICTURES * (difference - usual)


def _breaks_below(
    mask: NDArray[np.bool_],
    vectors: NDArray[np.complex128],
    pictures: NDArray[np.uint64],
    bits: _Bits,
) -> tuple[NDArray[np.intp], Floats, Floats]:
    """Return the cells with a neighbour below, how ridges turn there, and the pictures differ.

    The turn is the squared sine of what remains of it without the mean turn before and after; the
    difference is the share of bits that differ across the border, less that within both cells.
    """
    both = mask[1:] & mask[:-1]
    step = vectors[1:] * vectors[:-1].conj()
    none = np.zeros_like(step[:1])
    mean = np.concatenate([none, step[:-1]]) + np.concatenate([step[1:], none])
    length = np.abs(mean)
    mean = np.where(length > _LEAST_MEAN, mean / np.maximum(length, _LEAST_MEAN), 1.0)
    within = _count((pictures ^ (pictures >> bits.next)) & bits.not_last) / 56
    across = _count(((pictures[:-1] >> bits.last) ^ pictures[1:]) & bits.first) / 8
    difference = across - (within[1:] + within[:-1]) / 2
    return np.argwhere(both), (1 - (step * mean.conj()).real[both]) / 2, difference[both]


def _count(pictures: NDArray[np.uint64]) -> Floats:
    """Return how many bits of each picture are set."""
    in_bytes = np.ascontiguousarray(pictures).view(np.uint8).reshape(*pictures.shape, 8)
    return np.asarray(_ONES[in_bytes].sum(axis=-1, dtype=np.float64))
