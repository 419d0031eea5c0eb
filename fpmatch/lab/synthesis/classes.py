"""The five classes of prints, their natural shares, and the positions of their singular points."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

Range = tuple[float, float]


class PatternClass(StrEnum):
    """Class of a print."""

    ARCH = "arch"
    TENTED_ARCH = "tented arch"
    LEFT_LOOP = "left loop"
    RIGHT_LOOP = "right loop"
    WHORL = "whorl"


NATURAL_SHARES: Final = {  # of all fingers, Wilson, Candela, Watson 1994
    PatternClass.ARCH: 0.037,
    PatternClass.TENTED_ARCH: 0.029,
    PatternClass.LEFT_LOOP: 0.338,
    PatternClass.RIGHT_LOOP: 0.317,
    PatternClass.WHORL: 0.279,
}


class SingularRanges(NamedTuple):
    """Set the rectangles that contain the singular points of one class.

    Each is a range of x and one of y in pixels from the middle of the fingertip, y up.
    """

    cores: tuple[tuple[Range, Range], ...] = ()
    deltas: tuple[tuple[Range, Range], ...] = ()


_LEFT_LOOP: Final = SingularRanges(
    cores=(((-25, 25), (5, 65)),), deltas=(((75, 140), (-165, -75)),)
)
SINGULAR_RANGES: Final = {
    PatternClass.ARCH: SingularRanges(),
    PatternClass.TENTED_ARCH: SingularRanges(
        cores=(((-10, 10), (5, 45)),), deltas=(((-12, 12), (-90, -45)),)
    ),
    PatternClass.LEFT_LOOP: _LEFT_LOOP,
    PatternClass.RIGHT_LOOP: _LEFT_LOOP,  # mirrored
    PatternClass.WHORL: SingularRanges(
        cores=(((-24, 12), (40, 80)), ((-10, 26), (-35, 15))),
        deltas=(((-140, -85), (-165, -85)), ((85, 140), (-165, -85))),
    ),
}


class SingularPoints(NamedTuple):
    """Positions of the singular points of one print, (K, 2), in pixels, x right and y down."""

    cores: NDArray[np.float64]
    deltas: NDArray[np.float64]


def draw_pattern(rng: np.random.Generator) -> PatternClass:
    """Draw a class in the natural proportions."""
    classes = list(NATURAL_SHARES)
    limits = np.cumsum(list(NATURAL_SHARES.values()))
    return classes[int(np.searchsorted(limits, rng.random() * limits[-1], side="right"))]


def draw_singular_points(
    pattern: PatternClass, centre: tuple[float, float], rng: np.random.Generator, size: float = 1.0
) -> SingularPoints:
    """Draw the singular points of a finger: none for an arch, two of each for a whorl, else one.

    `centre` is the middle of the fingertip, x and y in pixels; `size` is relative to an average
    finger.
    """
    ranges = SINGULAR_RANGES[pattern]
    always, never = pattern is PatternClass.RIGHT_LOOP, pattern is PatternClass.LEFT_LOOP
    mirrored = (rng.random() < 0.5 or always) and not never
    flip = np.array([-1.0 if mirrored else 1.0, -1.0]) * size  # y up becomes y down
    drawn = (
        np.array([[rng.uniform(*x), rng.uniform(*y)] for x, y in rectangles]).reshape(-1, 2)
        for rectangles in ranges
    )
    return SingularPoints(*(np.asarray(centre) + flip * points for points in drawn))
