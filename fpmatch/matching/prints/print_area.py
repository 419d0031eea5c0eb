"""The area of a print: cells inside its mask, or inside the convex hull of its minutiae."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from fpmatch.matching.constants.prints import ORIENTATIONS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import RidgeField


@dataclass(frozen=True, slots=True, eq=False)
class PrintArea:
    """The area of a print as square cells, and their ridge orientation.

    A code is 0 outside the print; inside, 1 to `ORIENTATIONS` for the ridge orientation, or 1 alone
    where it is not known.
    """

    step: float  # side of a cell
    code: NDArray[np.uint8]  # (rows, columns)
    first_row: int  # of these cells among all, from the image's top left corner
    first_column: int
    has_flow: bool  # whether the orientation is known at all
    ridges: NDArray[np.uint64] | None = None  # binary images as in `RidgeField`, where known

    @property
    def inside(self) -> int:
        """Number of cells inside the print."""
        return int(np.count_nonzero(self.code))

    @property
    def area(self) -> float:
        """Area of the print."""
        return self.inside * (self.step * self.step)


def orientation_codes(
    orientation: NDArray[np.floating], mask: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Return the codes of orientations in radians: 1 to `ORIENTATIONS`, and 0 outside the mask."""
    code = np.zeros(mask.shape, np.uint8)
    step = np.rint(orientation[mask].astype(np.float64) * (ORIENTATIONS / np.pi))
    code[mask] = step.astype(np.int64) % ORIENTATIONS + 1
    return code


def codes_at(region: PrintArea, z: NDArray[np.complex128]) -> NDArray[np.uint8]:
    """Return the codes of a print area at places x + iy, y pointing up: 0 outside."""
    per_px = 1.0 / region.step
    x, y = z.real * per_px - region.first_column, -z.imag * per_px - region.first_row
    rows, columns = region.code.shape
    codes = np.zeros(z.shape, np.uint8)
    within = (x >= 0.0) & (x < columns) & (y >= 0.0) & (y < rows)
    codes[within] = region.code[y[within].astype(np.intp), x[within].astype(np.intp)]
    return codes


def area_of_field(field: RidgeField, to_500dpi: float) -> PrintArea:
    """Return the mask of a ridge field with its orientation and ridges, at 500 dpi."""
    box, at = _box(field.mask)
    code = orientation_codes(field.orientation[box], field.mask[box])
    ridges = None if field.ridges is None else np.ascontiguousarray(field.ridges[box])
    return PrintArea(field.step * to_500dpi, code, *at, has_flow=True, ridges=ridges)


def area_of_hull(points: NDArray[np.float64], step_px: float, max_cells: int) -> PrintArea:
    """Return the convex hull of minutiae (4, N) as an area of unknown orientation.

    Its cells have a side of `step_px`, or larger ones where more than `max_cells` would lie along a
    side of the area.
    """
    inside = (points[0] >= 0) & (points[1] <= 0)
    x, y = points[0, inside], -points[1, inside]
    reach = max(x.max(initial=0.0), y.max(initial=0.0))
    step = max(step_px, reach / max_cells)
    corners = np.floor(np.column_stack([x, y]) / step).astype(np.int32)
    size = (corners.max(axis=0) + 1) if len(corners) else np.array([1, 1])
    mask = np.zeros((int(size[1]), int(size[0])), np.uint8)
    if len(corners):
        cv2.fillConvexPoly(mask, cv2.convexHull(corners), 1)
    box, at = _box(mask)
    return PrintArea(step, np.ascontiguousarray(mask[box]), *at, has_flow=False)


def _box(mask: NDArray[Any]) -> tuple[tuple[slice, slice], tuple[int, int]]:
    """Return the part of a mask without empty rows and columns around it, and where it begins."""
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8)) if mask.size else (0, 0, 0, 0)
    return (slice(top, top + height), slice(left, left + width)), (top, left)
