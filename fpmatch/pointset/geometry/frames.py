"""The unit frame of a point set, in which matchers work: shift and scale into [0, 1]²."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.errors import PointSetError
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class UnitFrame:
    """Shift points to the origin and scale them by a power of two, so that they span [0, 1]².

    The coordinates of a point x in the frame are ``(x - (x0, y0))·2**-exponent``, exact for whole
    pixels.
    """

    exponent: int = 0
    x0: float = 0.0
    y0: float = 0.0

    @classmethod
    def of(cls, points: NDArray[np.float64]) -> UnitFrame:
        """Return the frame in which the larger side of `points` (N, 2) lies in [0.5, 1)."""
        if not len(points):
            return cls()
        corner = points.min(axis=0)
        return cls(int(np.frexp((points - corner).max())[1]), *corner.tolist())

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `points` (N, 2) in the frame."""
        return np.asarray(np.ldexp(points - (self.x0, self.y0), -self.exponent))

    def as_similarity(self) -> Similarity:
        """Return the transform from points as given into the frame."""
        x0, y0 = (math.ldexp(value, -self.exponent) for value in (self.x0, self.y0))
        return Similarity(math.ldexp(1.0, -self.exponent), 0.0, -x0, -y0)


def frame_of(points: NDArray[np.float64], name: str = "points") -> UnitFrame:
    """Return the unit frame of `points` (N, 2); refuse extents below 2**-300 under their `name`."""
    frame = UnitFrame.of(points)
    if frame.exponent < -300:
        raise PointSetError(f"{name}: extent beyond 2**-300")
    return frame


def between_sets(move: Similarity, frame_p: UnitFrame, frame_q: UnitFrame) -> Similarity:
    """Return the transform between two sets as given, of one between their unit frames."""
    if frame_p == frame_q == UnitFrame():
        return move
    return frame_q.as_similarity().inverse().after(move).after(frame_p.as_similarity())
