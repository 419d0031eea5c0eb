"""Signs of several prints in one template, which would match all of their fingers.

The ridges of one print continue over its whole area, and its minutiae lie along them. Of 1,218 real
prints of eleven databases at most 2 have one. Minutiae alone are judged by
`fpmatch.templates.plausibility`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.templates import plausibility
from fpmatch.templates.minutiae import MM_PER_INCH, RidgeField

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Minutiae, Template

    Floats = NDArray[np.float64]

# A sign is a measure beyond its limit.
MIN_AREA_MM2: Final = 30.0  # of prints that lie apart, without the outermost cells of each
MIN_BREAK: Final = 0.33  # of the ridges along a line
MIN_ACROSS: Final = 5  # minutiae across the ridges, and
MIN_ACROSS_SHARE: Final = 0.08

_MOST_CELLS: Final = 8192  # of a field; of more, some are left out
DIRECTIONS: Final = 24  # of lines
_PER_CELL: Final = 2  # lines of one direction
_MIN_PART: Final = 0.2  # of the cells of a print, on either side of a line
_MIN_CROSSED: Final = 6  # pairs of cells
_EVEN_PAIRS: Final = 8  # without a break, that are added to the crossed ones: few weigh little
_FULL_TURN: Final = 0.3  # squared sine of a turn of the ridges that counts as a whole break
_LEAST_MEAN: Final = 0.2  # length of the mean turn from which it is one
_CERTAIN: Final = 0.6  # length of a mean of unit vectors from which an orientation is certain
_ADDED: Final = 8  # minutiae without a sign, that are added: few weigh little
_ACROSS: Final = 0.2  # squared sine of the angle between a minutia and the ridges

_DOWN, _RIGHT = np.array([1, 0]), np.array([0, 1])


def why_two_prints(template: Template) -> str:
    """Return why a template probably has the prints of two fingers; "" where nothing indicates it.

    That is so for minutiae without ridges.
    """
    m, field = template.minutiae, _coarse(template.field)
    if field is None or not field.mask.any():
        return ""
    number = count_areas(field, template.dpi)
    across, share = minutiae_across(m, field)
    many = "two" if number == 2 else str(number)
    signs = [f"the ridges have {many} areas"] * (number > 1)
    signs += ["the ridges break off along a line"] * (greatest_break(field) > MIN_BREAK)
    signs += ["minutiae lie across the ridges"] * (
        across >= MIN_ACROSS and share > MIN_ACROSS_SHARE
    )
    if number <= 1:
        return f"probably two prints in one: {', '.join(signs)}" if signs else ""
    return f"probably {many} prints in one: {', '.join(signs)}; cut them into one image each"


def find_doubts(template: Template) -> tuple[str, ...]:
    """Return the doubts of `fpmatch.templates.plausibility`, and why there are probably two prints.

    There are none for most prints.
    """
    return tuple(filter(None, (*plausibility.find_doubts(template), why_two_prints(template))))


def count_areas(field: RidgeField, dpi: float) -> int:
    """Return how many areas of ridges lie apart, that are as large as a print."""
    import cv2  # noqa: PLC0415  (which templates alone do not need)

    inner = cv2.erode(np.pad(field.mask, 1).view(np.uint8), np.ones((3, 3), np.uint8))[1:-1, 1:-1]
    _, _, stats, _ = cv2.connectedComponentsWithStats(inner, connectivity=4)
    sides = np.sqrt(stats[1:, cv2.CC_STAT_AREA]) * field.step * MM_PER_INCH / dpi
    return int(np.count_nonzero(sides >= math.sqrt(MIN_AREA_MM2)))


def greatest_break(field: RidgeField) -> float:
    """Return how far the ridges break off along the straight line where they do most.

    Ridges break off where they turn otherwise across the line than beside it. Lines have a large
    part of the print on either side.
    """
    cells = np.argwhere(field.mask)
    vectors = _doubled_orientation(field)
    upper, down = _breaks_below(field.mask, vectors)
    left, right = _breaks_below(field.mask.T, vectors.T)
    left = left[:, ::-1]
    breaks = np.concatenate([down, right])
    one = _lines_beyond(np.concatenate([upper, left]))
    other = _lines_beyond(np.concatenate([upper + _DOWN, left + _RIGHT]))
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
    large = np.minimum(part, len(cells) - part) > _MIN_PART * len(cells)
    wide = large & (crossed >= _MIN_CROSSED)
    return float((broken[wide] / (crossed[wide] + _EVEN_PAIRS)).max(initial=0.0))


def minutiae_across(m: Minutiae, field: RidgeField) -> tuple[int, float]:
    """Return how many minutiae lie across the ridges, and their share where these are certain."""
    vectors = np.pad(_doubled_orientation(field), ((0, 1), (0, 1)))
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


def _coarse(field: RidgeField | None) -> RidgeField | None:
    """Return a field with every second cell or fewer where there are more than of any finger."""
    if field is None or field.mask.size <= _MOST_CELLS:
        return field
    every = math.ceil(math.sqrt(field.mask.size / _MOST_CELLS))
    part = np.s_[::every, ::every]
    return RidgeField(every * field.step, field.orientation[part], field.mask[part])


def _doubled_orientation(field: RidgeField) -> NDArray[np.complex128]:
    """Return the orientations as unit vectors of twice the angle, 0 outside the print."""
    vectors = np.exp(2j * np.where(field.mask, field.orientation, 0).astype(np.float64))
    return np.asarray(vectors * field.mask)


def _lines_beyond(cells: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the first line beyond each cell (N, 2), in each direction: (24, N)."""
    turn = np.arange(DIRECTIONS)[:, None] * (np.pi / DIRECTIONS)
    place: Floats = np.sin(turn) * cells[:, 1] + np.cos(turn) * cells[:, 0]
    return np.ceil(_PER_CELL * place + 1e-6).astype(np.intp)


def _breaks_below(
    mask: NDArray[np.bool_], vectors: NDArray[np.complex128]
) -> tuple[NDArray[np.intp], Floats]:
    """Return the cells with a neighbour below, and how far the ridges break off there, 0 to 1.

    That is how far they turn otherwise than, in the mean, before and after it.
    """
    both = mask[1:] & mask[:-1]
    step = vectors[1:] * vectors[:-1].conj()
    beside = np.pad(step, ((1, 1), (0, 0)))
    mean = beside[:-2] + beside[2:]
    length = np.abs(mean)
    mean = np.where(length > _LEAST_MEAN, mean / np.maximum(length, _LEAST_MEAN), 1.0)
    turn = (1 - (step * mean.conj()).real[both]) / 2
    return np.argwhere(both), np.minimum(turn / _FULL_TURN, 1.0)
