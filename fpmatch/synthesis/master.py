"""A master print: all properties of one finger, before it touches a sensor."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import ImageError
from fpmatch.synthesis.classes import PatternClass, Range, draw_pattern, draw_singular_points
from fpmatch.synthesis.growth import GrowthParameters, grow_ridges
from fpmatch.synthesis.master_minutiae import MinutiaeParameters, list_minutiae
from fpmatch.synthesis.orientation import OrientationParameters, ridge_orientation
from fpmatch.synthesis.period import PeriodParameters, ridge_period
from fpmatch.synthesis.silhouette import SilhouetteParameters, fingertip_silhouette

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.minutiae import Minutiae

AVERAGE_ROWS: Final = 560  # of a print of average size, to which lengths in the classes refer
SMALLEST_SIDE_PX: Final = 64
LARGEST_SIDE_PX: Final = 2048
NO_IMPRESSION: Final = 0  # in the place of an impression's number: impressions count from 1


class _Purpose(IntEnum):
    """Purposes of random streams; each has its own, so that they do not influence each other."""

    PATTERN = 1
    POINTS = 2
    ORIENTATION = 3
    PERIOD = 4
    SILHOUETTE = 5
    GROWTH = 6


@dataclass(frozen=True, slots=True)
class MasterParameters:
    """Set how masters are made.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns at 500 dpi. A smaller print has a smaller pattern of equal ridge width.
    finger_size : (float, float)
        Range of a finger's size relative to an average finger.
    pattern : PatternClass, optional
        Class of every finger (default: drawn in the natural proportions).
    orientation, period, silhouette, growth, minutiae
        Parameters of each step.

    Raises
    ------
    ImageError
        If a side is not between 64 and 2048 pixels.
    """

    shape: tuple[int, int] = (AVERAGE_ROWS, 440)
    finger_size: Range = (0.92, 1.06)
    pattern: PatternClass | None = None
    orientation: OrientationParameters = field(default_factory=OrientationParameters)
    period: PeriodParameters = field(default_factory=PeriodParameters)
    silhouette: SilhouetteParameters = field(default_factory=SilhouetteParameters)
    growth: GrowthParameters = field(default_factory=GrowthParameters)
    minutiae: MinutiaeParameters = field(default_factory=MinutiaeParameters)

    def __post_init__(self) -> None:
        if not all(SMALLEST_SIDE_PX <= side <= LARGEST_SIDE_PX for side in self.shape):
            rows, columns = self.shape
            raise ImageError(
                f"a master print of {rows} x {columns} pixels: each side must lie "
                f"between {SMALLEST_SIDE_PX} and {LARGEST_SIDE_PX}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Master:
    """Hold one finger: its ridges on all the skin that a sensor may touch, at 500 dpi.

    Parameters
    ----------
    seed, finger : int
        Identity of the finger: the same two give the same arrays.
    pattern : PatternClass
        Class of the print.
    orientation : ndarray of float32, shape (H, W)
        Ridge orientation in radians in [0, π), counter-clockwise on screen from +x.
    period : ndarray of float32, shape (H, W)
        Pixels from ridge to ridge.
    relief : ndarray of float32, shape (H, W)
        Height, from -1 in the valleys to 1 on the ridges, also beyond the silhouette.
    silhouette : ndarray of bool, shape (H, W)
        True on the print.
    minutiae : Minutiae
        All minutiae inside the silhouette, in pixels of these arrays.
    cores, deltas : ndarray of float64, shape (K, 2)
        Singular points, x and y in pixels; a delta may lie beyond the silhouette.
    """

    seed: int
    finger: int
    pattern: PatternClass
    orientation: NDArray[np.float32] = field(repr=False)
    period: NDArray[np.float32] = field(repr=False)
    relief: NDArray[np.float32] = field(repr=False)
    silhouette: NDArray[np.bool_] = field(repr=False)
    minutiae: Minutiae = field(repr=False)
    cores: NDArray[np.float64] = field(repr=False)
    deltas: NDArray[np.float64] = field(repr=False)

    def __post_init__(self) -> None:
        for layer in (self.orientation, self.period, self.relief, self.silhouette):
            layer.setflags(write=False)
        for points in (self.cores, self.deltas):
            points.setflags(write=False)


def make_master(seed: int, finger: int, parameters: MasterParameters | None = None) -> Master:
    """Make one finger, by its number from 0, of the family that `seed` names.

    No finger depends on another.

    Examples
    --------
    >>> master = make_master(7, 1, MasterParameters(shape=(160, 120)))
    >>> master.relief.shape, len(master.minutiae) > 0
    ((160, 120), True)
    """
    p = parameters or MasterParameters()
    classing, placing, turning, spacing, outlining, growing = (
        np.random.default_rng([seed, finger, NO_IMPRESSION, purpose]) for purpose in _Purpose
    )
    rows, columns = p.shape
    pattern = p.pattern or draw_pattern(classing)
    size = placing.uniform(*p.finger_size) * rows / AVERAGE_ROWS
    points = draw_singular_points(pattern, (columns / 2, rows / 2), placing, size=size)
    orientation = ridge_orientation(pattern, points, p.shape, turning, p.orientation, size=size)
    period = ridge_period(p.shape, spacing, p.period)
    silhouette = fingertip_silhouette(p.shape, outlining, p.silhouette)
    relief = grow_ridges(orientation, period, growing, p.growth)
    return Master(
        seed=seed,
        finger=finger,
        pattern=pattern,
        orientation=orientation,
        period=period,
        relief=relief,
        silhouette=silhouette,
        minutiae=list_minutiae(relief, orientation, period, silhouette, p.minutiae),
        cores=points.cores,
        deltas=points.deltas,
    )
