"""Bare 2-D points: the check that every function of this room begins with, and their frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset._bounding_box_kernel import bounding_box

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


Box = tuple[float, float, float, float]
"""Least and largest x, least and largest y."""


def as_points(points: ArrayLike, name: str = "points") -> NDArray[np.float64]:
    """Return `points` as float64 of shape (N, 2), or refuse them.

    Parameters
    ----------
    points : array_like of float, shape (N, 2)
        The points; an empty array of any shape stands for no points.
    name : str
        What to call them in an error.

    Returns
    -------
    ndarray of float64, shape (N, 2)
        The points; a copy.

    Raises
    ------
    PointSetError
        If the values are not numbers, not finite, or not of that shape.

    Examples
    --------
    >>> as_points([[1, 2]]).dtype
    dtype('float64')
    """
    return points_in_box(points, name)[0]


def points_in_box(points: ArrayLike, name: str = "points") -> tuple[NDArray[np.float64], Box]:
    """Return what `as_points` does, and the bounding box: see `box_of`; zeros for no points."""
    try:
        array = np.array(points, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise PointSetError(f"{name}: expected an array of numbers of shape (N, 2)") from error
    if array.size == 0:
        return array.reshape(0, 2), (0.0, 0.0, 0.0, 0.0)
    if array.ndim != 2 or array.shape[1] != 2:
        raise PointSetError(f"{name}: expected an array of shape (N, 2), not {array.shape}")
    box = np.empty(4)
    if not bounding_box(array, box):
        raise PointSetError(f"{name}: coordinates must be finite")
    left, right, top, bottom = box.tolist()
    return array, (left, right, top, bottom)


def box_of(points: NDArray[np.float64]) -> Box:
    """Return least and largest x, least and largest y of `points` (N, 2), N > 0, writable."""
    box = np.empty(4)
    bounding_box(points, box)
    left, right, top, bottom = box.tolist()
    return left, right, top, bottom


@dataclass(frozen=True, slots=True)
class UnitFrame:
    """Shift points to the origin and scale them by a power of two, so that they span [0, 1]².

    A point x stands at ``(x·2**-magnitude - (x0, y0))·2**-span`` in the frame: exact for whole
    pixels, and within reach of float64 whatever the magnitude of the points.

    Examples
    --------
    >>> points = np.array([[10.0, 20.0], [16.0, 20.0]])
    >>> frame = UnitFrame.of(points)
    >>> frame.apply(points).tolist()
    [[0.0, 0.0], [0.75, 0.0]]
    """

    magnitude: int = 0
    span: int = 0
    x0: float = 0.0
    y0: float = 0.0

    @classmethod
    def of(cls, points: NDArray[np.float64]) -> UnitFrame:
        """Return the frame in which the larger side of `points` (N, 2) lies in [0.5, 1)."""
        if not len(points):
            return cls()
        magnitude = _exponent(points)
        tamed = np.ldexp(points, -magnitude)  # so that the span of huge points is finite
        corner = tamed.min(axis=0)
        x0, y0 = corner.tolist()
        return cls(magnitude, _exponent(tamed - corner), x0, y0)

    @property
    def exponent(self) -> int:
        """Power of two by which the frame is smaller than the points."""
        return self.magnitude + self.span

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `points` (N, 2) in the frame; themselves where that is as they stand."""
        if self is IDENTITY:
            return points
        shifted = np.ldexp(points, -self.magnitude) - (self.x0, self.y0)
        return np.asarray(np.ldexp(shifted, -self.span))


def _exponent(values: NDArray[np.float64]) -> int:
    return int(np.frexp(np.abs(values).max())[1])


IDENTITY: Final = UnitFrame()
"""The frame of points that stay as they stand."""
