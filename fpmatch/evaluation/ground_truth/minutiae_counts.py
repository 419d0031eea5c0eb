"""How well extracted minutiae agree with the true ones: right, missed, false.

Extracted and true minutiae are assigned to each other one to one. A pair lies within a tolerance
of distance and direction, and its extracted minutia is right; a true minutia without a partner is
missed, an extracted one without is false. True minutiae that cannot be seen are not asked for:
whoever finds one is neither right nor false.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.minutiae import Minutiae


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Set within what an extracted minutia is a true one.

    Parameters
    ----------
    distance_px : float
        Largest distance, inclusive, in pixels of the minutiae's frame.
    turn : float
        Largest difference of direction, inclusive, in radians; π allows any.
    """

    distance_px: float
    turn: float

    def __str__(self) -> str:
        return f"{self.distance_px:g} px, {math.degrees(self.turn):g}°"


MAIN_TOLERANCE: Final = Tolerance(12.0, math.pi / 8)
TOLERANCES: Final = (Tolerance(16.0, math.pi / 6), MAIN_TOLERANCE, Tolerance(8.0, math.pi / 10))


@dataclass(frozen=True, slots=True)
class MinutiaeCounts:
    """Count extracted and true minutiae of some prints; counts add up.

    Parameters
    ----------
    right : int
        Extracted minutiae that are true ones to be seen.
    missed : int
        True minutiae to be seen that none of the extracted is.
    false : int
        Extracted minutiae that are no true ones.
    unseen : int
        Extracted minutiae that are true ones not to be seen: neither right nor false.
    """

    right: int = 0
    missed: int = 0
    false: int = 0
    unseen: int = 0

    def __add__(self, other: MinutiaeCounts) -> MinutiaeCounts:
        return MinutiaeCounts(
            self.right + other.right,
            self.missed + other.missed,
            self.false + other.false,
            self.unseen + other.unseen,
        )

    @property
    def extracted(self) -> int:
        """Number of extracted minutiae."""
        return self.right + self.false + self.unseen

    @property
    def true(self) -> int:
        """Number of true minutiae to be seen."""
        return self.right + self.missed

    @property
    def precision(self) -> float:
        """Share of the right among the right and false; NaN where there are none."""
        return _share(self.right, self.right + self.false)

    @property
    def recall(self) -> float:
        """Share of the true minutiae to be seen that were found; NaN where there are none."""
        return _share(self.right, self.true)

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall; NaN where there is nothing at all."""
        return _share(2 * self.right, 2 * self.right + self.missed + self.false)


def count_minutiae(
    found: Minutiae,
    true: Minutiae,
    visible: NDArray[np.bool_],
    tolerance: Tolerance = MAIN_TOLERANCE,
    *,
    with_kind: bool = False,
) -> MinutiaeCounts:
    """Count right, missed and false minutiae of one print; arguments as in `assign_minutiae`.

    Examples
    --------
    >>> from fpmatch.minutiae import Minutiae
    >>> true = Minutiae(x=[10, 50, 90], y=[10, 50, 90], angle=[0.0, 1.0, 2.0])
    >>> found = Minutiae(x=[12, 50, 88], y=[10, 50, 90], angle=[0.1, 4.0, 2.0])
    >>> count_minutiae(found, true, np.array([True, True, False]))
    MinutiaeCounts(right=1, missed=1, false=1, unseen=1)
    """
    pairs = assign_minutiae(found, true, visible, tolerance, with_kind=with_kind)
    right = int(np.count_nonzero(visible[pairs[:, 1]]))
    return MinutiaeCounts(
        right=right,
        missed=int(np.count_nonzero(visible)) - right,
        false=len(found) - len(pairs),
        unseen=len(pairs) - right,
    )


def assign_minutiae(
    found: Minutiae,
    true: Minutiae,
    visible: NDArray[np.bool_],
    tolerance: Tolerance = MAIN_TOLERANCE,
    *,
    with_kind: bool = False,
) -> NDArray[np.intp]:
    """Assign extracted minutiae to true ones, one to one.

    Of all assignments within the tolerance, one with the most visible true minutiae, among these
    with the most invisible ones, and among these with the least sum of squared distances and
    turns, each in units of its tolerance.

    Parameters
    ----------
    found, true : Minutiae
        Extracted and true minutiae, in one frame.
    visible : ndarray of bool, shape (number of true,)
        Which of the true ones can be seen.
    tolerance : Tolerance
        How far the two of a pair may differ.
    with_kind : bool
        Whether the two of a pair must be of one kind.

    Returns
    -------
    ndarray of intp, shape (K, 2)
        Indices into `found` and `true`, sorted by the first.
    """
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415

    distance, turn = differences(found, true)
    allowed = (distance <= tolerance.distance_px) & (turn <= tolerance.turn)
    if with_kind:
        allowed &= found.kind[:, None] == true.kind[None]
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
    return part / whole if whole else float("nan")
