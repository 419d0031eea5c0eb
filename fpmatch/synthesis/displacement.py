"""Displacement of stretched skin from unstretched skin, as a grid of shifts for a file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.pointset.geometry.points import as_points
from fpmatch.synthesis.warp import solved

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Points = NDArray[np.float64]  # shape (N, 2), x and y

FEWEST_NODES: Final = 4  # along a side, so that a cubic fits
LEAST_STEP: Final = 1e-3  # pixels: places in nodes do not overflow
SOLVED_PX: Final = 1e-6  # largest step of a point when `stretched` stops


@dataclass(frozen=True, slots=True, eq=False)
class DisplacementField:
    """Map points of an image to where they would lie in unstretched skin.

    Node ``[i, j]`` lies at pixel ``((j - 1) * step, (i - 1) * step)``: one node more than needed
    on each side, so that the whole image is interpolated from nodes around it. Between nodes the
    shift is the cubic convolution (Catmull–Rom, a = -1/2) of the 4 x 4 nodes around. An ImageError
    is raised if the step is not above zero, or the shifts are too few, not finite or of another
    shape.

    References
    ----------
    Keys, "Cubic convolution interpolation for digital image processing", IEEE Trans. ASSP 29
    (1981).
    """

    step: float  # pixels from node to node
    shift: NDArray[np.float64]  # x and y in pixels, (rows, columns, 2), at least 4 x 4 nodes

    def __post_init__(self) -> None:
        shift = np.array(self.shift, dtype=np.float64)
        if shift.ndim != 3 or min(shift.shape[:2]) < FEWEST_NODES or shift.shape[2] != 2:
            raise ImageError("a displacement field needs at least 4 x 4 nodes with dx and dy")
        if not (np.isfinite(self.step) and self.step >= LEAST_STEP and np.isfinite(shift).all()):
            least = f"a step of {LEAST_STEP:g} pixels at least"
            raise ImageError(f"a displacement field needs {least} and finite shifts")
        shift.setflags(write=False)
        object.__setattr__(self, "step", float(self.step))
        object.__setattr__(self, "shift", shift)

    @classmethod
    def sampled(
        cls, relaxed: Callable[[Points], Points], shape: tuple[int, int], step: float
    ) -> DisplacementField:
        """Sample a map of points (N, 2) over an image of `shape` rows and columns."""
        y, x = (np.arange(-1, (side - 1) // step + 3) * step for side in shape)
        nodes = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2).astype(np.float64)
        return cls(step, (relaxed(nodes) - nodes).reshape(len(y), len(x), 2))

    def at(self, points: ArrayLike) -> Points:
        """Return the shifts at `points` (N, 2); beyond the nodes, those at their edge."""
        rows, columns = self.shift.shape[:2]
        place = as_points(points) / self.step + 1
        place = np.clip(place, 1, (columns - 2, rows - 2))
        corner = np.minimum(np.floor(place), (columns - 3, rows - 3)).astype(np.intp)
        across, along = (_cubic_weights(part) for part in (place - corner).T)
        shift = np.zeros((len(place), 2))
        for i in range(FEWEST_NODES):
            for j in range(FEWEST_NODES):
                node = self.shift[corner[:, 1] + i - 1, corner[:, 0] + j - 1]
                shift += (along[i] * across[j])[:, None] * node
        return shift

    def relaxed(self, points: ArrayLike) -> Points:
        """Return the positions of `points` (N, 2) of the image in unstretched skin."""
        p = as_points(points)
        return np.asarray(p + self.at(p))

    def stretched(self, points: ArrayLike) -> Points:
        """Return the positions in the image of `points` (N, 2) of unstretched skin."""
        return solved(as_points(points), lambda p: -self.at(p), SOLVED_PX)


def _cubic_weights(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Return the weights of the four nodes around, for `t` from 0 to 1 after the second."""
    return (
        ((-0.5 * t + 1.0) * t - 0.5) * t,
        (1.5 * t - 2.5) * t * t + 1.0,
        ((-1.5 * t + 2.0) * t + 0.5) * t,
        (0.5 * t - 0.5) * t * t,
    )
