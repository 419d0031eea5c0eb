"""Places on the page: 3 x 3 matrices from the pixels of a print to page coordinates.

Pixels of a print are counted at their centres, (0, 0) the first. `fpmatch.drawing.scene.items`
defines page coordinates.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.scene.items import Box

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from fpmatch.drawing.scene.items import Point
    from fpmatch.pointset.geometry.similarity import Similarity

    Matrix = NDArray[np.float64]

_FAR: Final = 1e7  # page pixels; beyond it nothing is drawn, and integers must not overflow


def zoomed(zoom: float, origin: Point, to: Point) -> Matrix:
    """Return the matrix that magnifies by `zoom` and takes `origin` (in the print) to `to`."""
    x, y = to[0] - zoom * origin[0], to[1] - zoom * origin[1]
    return np.array([[zoom, 0.0, x], [0.0, zoom, y], [0.0, 0.0, 1.0]])


def of_transform(transform: Similarity) -> Matrix:
    """Return a similarity transform as a matrix."""
    return np.vstack([transform.matrix, [0.0, 0.0, 1.0]])


def moved(matrix: Matrix, points: ArrayLike) -> list[Point]:
    """Map `points` (shape (N, 2)) onto the page; coordinates are clipped to ±1e7 pixels."""
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    with np.errstate(over="ignore", invalid="ignore"):
        q = p @ matrix[:2, :2].T + matrix[:2, 2]
    q = np.clip(np.nan_to_num(q, nan=_FAR), -_FAR, _FAR)
    return [(x, y) for x, y in q.tolist()]


def magnification(matrix: Matrix) -> float:
    """Return by how much `matrix` enlarges lengths."""
    return math.hypot(matrix[0, 0], matrix[1, 0])


def direction_on_page(matrix: Matrix, angle: float) -> Point:
    """Return the unit vector on the page of a minutia's direction, y down."""
    linear = matrix[:2, :2] / magnification(matrix)
    x, y = linear @ (math.cos(angle), -math.sin(angle))
    return float(x), float(y)


def corners(width: int, height: int) -> Matrix:
    """Return the four outer corners of an image, in its pixels, shape (4, 2)."""
    return np.array(Box(-0.5, -0.5, width, height).corners)


def bounds(points: list[Point]) -> Box:
    """Return the smallest box around `points`."""
    xs, ys = zip(*points, strict=True)
    return Box(min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys))
