"""Extracted minutiae compared with the true ones: true and false positives, false negatives.

Extracted and true minutiae are assigned to each other one to one, within a tolerance of distance
and direction. An extracted minutia that is assigned to a visible true one is a true positive, one
without a partner a false positive; a visible true minutia without a partner is a false negative.
Extracted minutiae that are assigned to invisible true ones are ignored.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Minutiae


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Set the largest distance and turn (radians; π allows any) of an assigned pair."""

    distance_px: float
    turn: float

    def __str__(self) -> str:
        return f"{self.distance_px:g} px, {math.degrees(self.turn):g}°"


MAIN_TOLERANCE: Final = Tolerance(12.0, math.pi / 8)
TOLERANCES: Final = (Tolerance(16.0, math.pi / 6), MAIN_TOLERANCE, Tolerance(8.0, math.pi / 10))


@dataclass(frozen=True, slots=True)
class MinutiaeCounts:
    """Count extracted and true minutiae of some prints; counts add up."""

    true_positives: int = 0
    false_negatives: int = 0
    false_positives: int = 0
    ignored: int = 0

    def __add__(self, other: MinutiaeCounts) -> MinutiaeCounts:
        return MinutiaeCounts(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    @property
    def extracted(self) -> int:
        """Number of extracted minutiae."""
        return self.true_positives + self.false_positives + self.ignored

    @property
    def true(self) -> int:
        """Number of visible true minutiae."""
        return self.true_positives + self.false_negatives

    @property
    def precision(self) -> float:
        """Share of true positives among the positives; NaN where there are none."""
        return _share(self.true_positives, self.true_positives + self.false_positives)

    @property
    def recall(self) -> float:
        """Share of the visible true minutiae that were found; NaN where there are none."""
        return _share(self.true_positives, self.true)

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall; NaN where there is nothing at all."""
        doubled = 2 * self.true_positives
        return _share(doubled, doubled + self.false_negatives + self.false_positives)


def count_minutiae(
    extracted: Minutiae,
    true: Minutiae,
    visible: NDArray[np.bool_],
    tolerance: Tolerance = MAIN_TOLERANCE,
    *,
    with_kind: bool = False,
) -> MinutiaeCounts:
    """Count the minutiae of one print; arguments as in `assign_minutiae`."""
    pairs = assign_minutiae(extracted, true, visible, tolerance, with_kind=with_kind)
    assigned = int(np.count_nonzero(visible[pairs[:, 1]]))
    return MinutiaeCounts(
        true_positives=assigned,
        false_negatives=int(np.count_nonzero(visible)) - assigned,
        false_positives=len(extracted) - len(pairs),
        ignored=len(pairs) - assigned,
    )


def assign_minutiae(
    extracted: Minutiae,
    true: Minutiae,
    visible: NDArray[np.bool_],
    tolerance: Tolerance = MAIN_TOLERANCE,
    *,
    with_kind: bool = False,
) -> NDArray[np.intp]:
    """Assign extracted minutiae to true ones, one to one.

    The assignment has the most visible true minutiae, then the most invisible ones, then the least
    sum of squared distances and turns in units of their tolerances. `visible` marks the visible
    ones of `true`. The two of a pair are within the tolerance and, if `with_kind`, of one kind.
    Returns indices into `extracted` and `true`, shape (K, 2), sorted by the first.
    """
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415

    distance, turn = differences(extracted, true)
    allowed = (distance <= tolerance.distance_px) & (turn <= tolerance.turn)
    if with_kind:
        allowed &= extracted.kind[:, None] == true.kind[None]
    apart = (distance / tolerance.distance_px) ** 2 + (turn / tolerance.turn) ** 2
    # One more pair is worth more than all of `apart`, a visible one more than all invisible ones.
    one_more = 2.0 * (min(allowed.shape) + 1)
    worth = np.where(visible, one_more * (min(allowed.shape) + 1), one_more)
    i, j = linear_sum_assignment(np.where(allowed, apart - worth, 0.0))
    paired = allowed[i, j]
    return np.column_stack([i[paired], j[paired]])


def differences(one: Minutiae, other: Minutiae) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return distances and differences of direction (0..π), each minutia against each other."""
    a, b = one.xy.astype(np.float64), other.xy.astype(np.float64)
    distance = np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1))
    turn = one.angle[:, None].astype(np.float64) - other.angle[None]
    return distance, np.abs(np.mod(turn + np.pi, 2 * np.pi) - np.pi)


def _share(part: int, whole: int) -> float:
    return part / whole if whole else math.nan
