"""How many prints lie apart in one template, which would match all of their fingers."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.templates.minutiae import MM_PER_INCH, RidgeField

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Template

# Of prints that lie apart on an image, without the outermost cells of each:
LEAST_PRINT_MM2: Final = 30.0
STRAIGHT: Final = 0.6  # length of the mean orientation of an area that may be a lower phalanx,
CROSSWISE: Final = -0.7  # and cosine of twice the angle between it and the way to the finger's tip
_MOST_CELLS: Final = 8192  # of a field; of more, some are left out


def count_prints(template: Template) -> int:
    """Return how many prints lie apart in a template; 1 where it may be one, or has no ridges.

    Two areas may be one finger, where the ridges of one run straight, without a loop or delta, and
    across the way to the other: those of a lower phalanx do.
    """
    field = coarse(template.field)
    if field is None or not field.mask.any():
        return 1
    import cv2  # noqa: PLC0415  (which templates alone do not need)

    inner = cv2.erode(np.pad(field.mask, 1).view(np.uint8), np.ones((3, 3), np.uint8))[1:-1, 1:-1]
    _, labels, stats, middles = cv2.connectedComponentsWithStats(inner, connectivity=4)
    sides = np.sqrt(stats[:, cv2.CC_STAT_AREA]) * field.step * MM_PER_INCH / template.dpi
    large = [k for k in range(1, len(stats)) if sides[k] >= math.sqrt(LEAST_PRINT_MM2)]
    if len(large) == 2:
        x, y = middles[large[1]] - middles[large[0]]
        along = complex(x, -y) ** 2 / (x * x + y * y)
        for area in (replace(field, mask=labels == k) for k in large):
            mean = doubled_orientation(area)[area.mask].mean()
            across = (mean / along).real < CROSSWISE * abs(mean)
            if across and abs(mean) > STRAIGHT and not any(count_loops(area)):
                return 1
    return max(1, len(large))


def count_loops(field: RidgeField) -> tuple[int, int]:
    """Return the numbers of loops and of deltas, by the Poincare index about four cells."""
    vectors = np.pad(doubled_orientation(field), 1)
    rows, columns = field.mask.shape
    near = [np.s_[i : i + rows, j : j + columns] for i in range(3) for j in range(3)]
    angle = np.angle(np.sum([vectors[part] for part in near], axis=0))
    inside = np.min([vectors[part] != 0 for part in near], axis=0)
    corners = np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, 1:], np.s_[1:, :-1]
    turn = np.zeros((rows - 1, columns - 1))
    for one, other in zip(corners, (*corners[1:], corners[0]), strict=True):
        turn += (angle[other] - angle[one] + np.pi) % (2 * np.pi) - np.pi
    index = np.round(turn / (2 * np.pi)) * np.min([inside[one] for one in corners], axis=0)
    return int(np.count_nonzero(index == -1)), int(np.count_nonzero(index == 1))


def coarse(field: RidgeField | None) -> RidgeField | None:
    """Return a field with every second cell or fewer where there are more than of any finger."""
    if field is None or field.mask.size <= _MOST_CELLS:
        return field
    every = math.ceil(math.sqrt(field.mask.size / _MOST_CELLS))
    part = np.s_[::every, ::every]
    return RidgeField(every * field.step, field.orientation[part], field.mask[part])


def doubled_orientation(field: RidgeField) -> NDArray[np.complex128]:
    """Return the orientations as unit vectors of twice the angle, 0 outside the print."""
    vectors = np.exp(2j * np.where(field.mask, field.orientation, 0).astype(np.float64))
    return np.asarray(vectors * field.mask)
