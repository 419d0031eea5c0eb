"""Signs of several prints in one template, which would match all of their fingers.

The ridges of one print continue over its whole area, its minutiae lie along them, and neighbouring
minutiae have similar directions. The limits are chosen so that at most one print in a thousand has
a sign.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.templates import plausibility
from fpmatch.templates.minutiae import MM_PER_INCH, STANDARD_DPI, RidgeField
from fpmatch.templates.plausibility import MOST_COMPARED, dpi_meant

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Minutiae, Template

    Floats = NDArray[np.float64]

# A sign is a measure beyond its limit; lengths are pixels at 500 dpi.
MIN_AREA_MM2: Final = 30.0  # of prints that lie apart, without the outermost cells of each
MAX_NECK: Final = 0.3  # width of the ridges at a line, in sides of a square as large as a part
MIN_BREAK: Final = 0.33  # of the ridges along a line
MIN_ACROSS: Final = 5  # minutiae across the ridges, and
MIN_ACROSS_SHARE: Final = 0.08
# where no ridges are known:
MIN_CONTRARY_SHARE: Final = 0.52  # of minutiae, with a neighbour of a contrary direction
MIN_GAP_PX: Final = 110.0  # strip between two groups of minutiae

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
_CONTRARY: Final = 0.6  # of the angle between two minutiae
_NEIGHBOUR_PX: Final = 48.0
_MIN_GROUP: Final = 8  # minutiae

_DOWN, _RIGHT = np.array([1, 0]), np.array([0, 1])


def why_two_prints(template: Template) -> str:
    """Return why a template probably has the prints of two fingers; "" where nothing indicates it.

    Minutiae alone show it less often than minutiae with ridges.
    """
    m, field = template.minutiae, _coarse(template.field)
    signs, number = [], 1
    if field is None or not field.mask.any():
        px = STANDARD_DPI / (dpi_meant(template) or template.dpi)
        signs += ["the minutiae form two groups"] * (widest_gap(m, px) > MIN_GAP_PX)
        if contrary_share(m, px) > MIN_CONTRARY_SHARE:
            signs.append("neighbouring minutiae have contrary directions")
    else:
        number = count_areas(field, template.dpi)
        neck, most = neck_and_break(field)
        across, share = minutiae_across(m, field)
        many = "two" if number <= 2 else str(number)
        signs += [f"the ridges have {many} areas"] * (neck < MAX_NECK or number > 1)
        signs += ["the ridges break off along a line"] * (most > MIN_BREAK)
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


def neck_and_break(field: RidgeField) -> tuple[float, float]:
    """Return how narrow the print is where it is narrowest, and how far its ridges break off.

    Both are those of the straight line where they are most, among lines with a large part of the
    print on either side. Ridges break off where they turn otherwise across the line than beside it.
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
    part = np.minimum(part, len(cells) - part)
    large = part > _MIN_PART * len(cells)
    neck = (crossed[large] / np.sqrt(part[large])).min(initial=np.inf)
    wide = large & (crossed >= _MIN_CROSSED)
    return float(neck), float((broken[wide] / (crossed[wide] + _EVEN_PAIRS)).max(initial=0.0))


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


def contrary_share(m: Minutiae, px: float) -> float:
    """Return the share of minutiae with a neighbour whose direction is contrary to theirs.

    A pixel of the print has `px` pixels at 500 dpi.
    """
    m = m.best(MOST_COMPARED)
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


def _directions() -> tuple[Floats, Floats]:
    """Return sine and cosine of the directions of lines, (24, 1) each."""
    turn = np.arange(DIRECTIONS)[:, None] * (np.pi / DIRECTIONS)
    return np.sin(turn), np.cos(turn)


def _lines_beyond(cells: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the first line beyond each cell (N, 2), in each direction: (24, N)."""
    sine, cosine = _directions()
    place = sine * cells[:, 1] + cosine * cells[:, 0]
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
