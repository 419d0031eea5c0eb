"""The unit frame of a point set, in which matchers work: shift and scale into [0, 1]²."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.pointset.geometry.points import Box

MAX_EXPONENT: Final = 300
"""Coordinates and extents reach 2**±300, so that no transform between sets leaves float64."""

MODERATE_EXPONENT: Final = 60
"""Coordinates and extents within 2**±60 need no frame."""


@dataclass(frozen=True, slots=True)
class UnitFrame:
    """Shift points to the origin and scale them by a power of two, so that they span [0, 1]².

    The coordinates of a point x in the frame are ``(x·2**-magnitude - (x0, y0))·2**-span``: exact
    for whole pixels, and within float64 whatever the magnitude of the points.
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
        scaled = np.ldexp(points, -magnitude)  # so that the span of huge points is finite
        corner = scaled.min(axis=0)
        x0, y0 = corner.tolist()
        return cls(magnitude, _exponent(scaled - corner), x0, y0)

    @property
    def exponent(self) -> int:
        """Power of two by which the frame is smaller than the points."""
        return self.magnitude + self.span

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `points` (N, 2) in the frame; the same array for `IDENTITY`."""
        if self is IDENTITY:
            return points
        shifted = np.ldexp(points, -self.magnitude) - (self.x0, self.y0)
        return np.asarray(np.ldexp(shifted, -self.span))

    def as_similarity(self) -> Similarity:
        """Return the transform from points as given into the frame."""
        if self is IDENTITY:
            return Similarity()
        x0, y0 = math.ldexp(self.x0, -self.span), math.ldexp(self.y0, -self.span)
        return Similarity(math.ldexp(1.0, -self.exponent), 0.0, -x0, -y0)


def _exponent(values: NDArray[np.float64]) -> int:
    return int(np.frexp(np.abs(values).max())[1])


IDENTITY: Final = UnitFrame()
"""The frame of points that keep their coordinates."""


def frame_of(points: NDArray[np.float64], name: str = "points") -> UnitFrame:
    """Return the unit frame of `points` (N, 2); refuse those beyond 2**±300 under their `name`."""
    frame = UnitFrame.of(points)
    if len(points) and max(frame.magnitude, -frame.exponent) > MAX_EXPONENT:
        raise PointSetError(f"{name}: coordinates or extent beyond 2**±{MAX_EXPONENT}")
    return frame


def frame_if_needed(points: NDArray[np.float64], box: Box, name: str = "points") -> UnitFrame:
    """Return `IDENTITY` where fourth powers of lengths stay within float64, else `frame_of`."""
    least, most = 2.0**-MODERATE_EXPONENT, 2.0**MODERATE_EXPONENT
    left, right, top, bottom = box
    if max(-left, right, -top, bottom) < most and max(right - left, bottom - top) > least:
        return IDENTITY
    return frame_of(points, name)


def between_sets(move: Similarity, frame_p: UnitFrame, frame_q: UnitFrame) -> Similarity:
    """Return the transform between two sets as given, of one between their unit frames."""
    if frame_p is frame_q is IDENTITY:
        return move
    return frame_q.as_similarity().inverse().after(move).after(frame_p.as_similarity())
