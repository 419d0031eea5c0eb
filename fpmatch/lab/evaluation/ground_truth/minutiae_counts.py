"""Extracted minutiae compared with the true ones: counts, and causes of false positives."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.ground_truth.truth import ImpressionTruth
    from fpmatch.templates.minutiae import Minutiae, Template


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


class Cause(StrEnum):
    """Causes of false positives, in the order in which they are tested."""

    DIRECTION = "wrong direction"  # an unassigned true minutia is there, but points elsewhere
    BORDER = "border"  # near the border of the print, as extracted, or of the image
    NO_RIDGES = "no ridges"  # of all the finger's minutiae, the nearest is hidden
    NEAR_ANOTHER = "near another"  # of another so near, a ridge must be split or doubled
    OTHER = "other"


BORDER_PX: Final = 18.0  # largest distance from the border at 500 dpi, two ridge periods
NEAR_PX: Final = 10.0  # largest distance of near minutiae at 500 dpi, a ridge period


def false_minutiae(template: Template, truth: ImpressionTruth) -> dict[int, Cause]:
    """Return the causes of the false positives at `MAIN_TOLERANCE`, by index of the minutia.

    The ridge field of the template gives the border of the print; the truth is in pixels of the
    same image.
    """
    px = template.dpi / STANDARD_DPI
    radius = MAIN_TOLERANCE.distance_px * px
    minutiae = template.minutiae
    paired = assign_minutiae(
        minutiae, truth.minutiae, truth.visible, Tolerance(radius, MAIN_TOLERANCE.turn)
    )
    false = np.setdiff1d(np.arange(len(minutiae)), paired[:, 0])
    if not false.size:
        return {}
    suspect = minutiae.take(false)
    free = np.setdiff1d(np.arange(len(truth.minutiae)), paired[:, 1])
    turned = assign_minutiae(
        suspect, truth.minutiae.take(free), truth.visible[free], Tolerance(radius, math.pi)
    )
    is_turned = np.isin(np.arange(len(suspect)), turned[:, 0])
    others, _ = differences(suspect, minutiae)
    others[np.arange(len(suspect)), false] = np.inf
    applies = {
        Cause.DIRECTION: is_turned,
        Cause.BORDER: distance_to_border(template, suspect.xy) <= BORDER_PX * px,
        Cause.NO_RIDGES: _nearest(suspect, truth.hidden_xy) < _nearest(suspect, truth.visible_xy),
        Cause.NEAR_ANOTHER: others.min(axis=1) <= NEAR_PX * px,
        Cause.OTHER: np.ones(len(suspect), dtype=bool),
    }
    first = np.argmax(np.stack([applies[cause] for cause in Cause]), axis=0)
    return {int(k): list(Cause)[c] for k, c in zip(false, first, strict=True)}


def distance_to_border(template: Template, points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the distances of points (N, 2) from the border of the print or image; 0 outside."""
    x, y = np.asarray(points, dtype=np.float64).T
    to_edge = np.min([x, y, template.width - x, template.height - y], axis=0).clip(min=0.0)
    field = template.field
    if field is None or field.mask.all():
        return np.asarray(to_edge)
    rows, columns = np.nonzero(~field.mask)  # blocks without ridges
    across = np.abs(x[:, None] - (columns + 0.5) * field.step) - field.step / 2
    down = np.abs(y[:, None] - (rows + 0.5) * field.step) - field.step / 2
    to_background = np.hypot(across.clip(min=0.0), down.clip(min=0.0)).min(axis=1)
    return np.asarray(np.minimum(to_edge, to_background))


def _nearest(minutiae: Minutiae, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance from each minutia to the nearest point; infinite where there is none."""
    apart = minutiae.xy.astype(np.float64)[:, None] - points[None]
    return np.asarray(np.hypot(*apart.transpose(2, 0, 1)).min(axis=1, initial=np.inf))
