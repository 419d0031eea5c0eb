"""The five classes of prints, their natural shares, and where their singular points lie."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

Range = tuple[float, float]


class PatternClass(StrEnum):
    """Class of a print, by the course of its ridges."""

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


@dataclass(frozen=True, slots=True)
class SingularRanges:
    """Set the rectangles in which the singular points of one class lie.

    Each is a range of x and one of y in pixels from the middle of the fingertip, x to the right
    and y up.
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
ALWAYS_MIRRORED: Final = (PatternClass.RIGHT_LOOP,)
NEVER_MIRRORED: Final = (PatternClass.LEFT_LOOP,)


@dataclass(frozen=True, slots=True)
class SingularPoints:
    """Hold the singular points of one print.

    Parameters
    ----------
    cores, deltas : ndarray of float64, shape (K, 2)
        Positions in pixels, x to the right and y down.
    """

    cores: NDArray[np.float64]
    deltas: NDArray[np.float64]


def draw_pattern(rng: np.random.Generator) -> PatternClass:
    """Draw a class in the natural proportions.

    Examples
    --------
    >>> str(draw_pattern(np.random.default_rng(1)))
    'right loop'
    """
    classes = list(NATURAL_SHARES)
    limits = np.cumsum(list(NATURAL_SHARES.values()))
    return classes[int(np.searchsorted(limits, rng.random() * limits[-1], side="right"))]


def draw_singular_points(
    pattern: PatternClass,
    centre: tuple[float, float],
    rng: np.random.Generator,
    *,
    size: float = 1.0,
) -> SingularPoints:
    """Draw the singular points of one finger of a class.

    Parameters
    ----------
    pattern : PatternClass
        Class of the print.
    centre : (float, float)
        Middle of the fingertip, x and y in pixels.
    rng : numpy.random.Generator
        Where the positions come from.
    size : float, optional
        Size of the finger beside one of average size (default 1).

    Returns
    -------
    SingularPoints
        One core and one delta; two of each for a whorl; none for an arch.

    Examples
    --------
    >>> points = draw_singular_points(PatternClass.WHORL, (220, 280), np.random.default_rng(1))
    >>> points.cores.shape, points.deltas.shape
    ((2, 2), (2, 2))
    """
    ranges = SINGULAR_RANGES[pattern]
    mirrored = rng.random() < 0.5
    if pattern in ALWAYS_MIRRORED + NEVER_MIRRORED:
        mirrored = pattern in ALWAYS_MIRRORED
    flip = np.array([-1.0 if mirrored else 1.0, -1.0]) * size  # y up becomes y down
    cores, deltas = (
        np.array([[rng.uniform(*x), rng.uniform(*y)] for x, y in rectangles]).reshape(-1, 2)
        for rectangles in (ranges.cores, ranges.deltas)
    )
    return SingularPoints(np.asarray(centre) + flip * cores, np.asarray(centre) + flip * deltas)
