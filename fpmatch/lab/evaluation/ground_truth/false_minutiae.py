"""The likeliest cause of each false positive among extracted minutiae."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.evaluation.ground_truth.minutiae_counts import (
    MAIN_TOLERANCE,
    Tolerance,
    assign_minutiae,
    differences,
)
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.ground_truth.truth import ImpressionTruth
    from fpmatch.templates.minutiae import Minutiae, Template


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
