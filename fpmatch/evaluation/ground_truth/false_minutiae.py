"""Why false minutiae are false: the likeliest cause of each, so that one sees what to mend."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.evaluation.ground_truth.minutiae_counts import (
    MAIN_TOLERANCE,
    Tolerance,
    assign_minutiae,
    differences,
)
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.evaluation.ground_truth.truth import ImpressionTruth
    from fpmatch.minutiae import Minutiae, RidgeField, Template


class Cause(StrEnum):
    """Name causes of false minutiae, in the order in which they are looked for.

    - DIRECTION: a true minutia that nobody else found is there, and points elsewhere;
    - BORDER: it lies near the border of the print, as the extractor sees it, or of the image;
    - NO_RIDGES: no ridges can be seen there: of all the finger's minutiae, the nearest is hidden;
    - NEAR_ANOTHER: another extracted minutia is so near that a ridge must be split or doubled;
    - OTHER: none of these.
    """

    DIRECTION = "wrong direction"
    BORDER = "border"
    NO_RIDGES = "no ridges"
    NEAR_ANOTHER = "near another"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class CauseParameters:
    """Set the reach of causes, in pixels at 500 dpi.

    Parameters
    ----------
    tolerance : Tolerance
        What counts as found; what is not is false.
    border_px : float
        Within this distance from the border, about two ridge periods, a minutia is near it.
    near_px : float
        Two extracted minutiae within this distance, about a ridge period, are near one another.
    """

    tolerance: Tolerance = MAIN_TOLERANCE
    border_px: float = 18.0
    near_px: float = 10.0


def false_minutiae(
    template: Template, truth: ImpressionTruth, parameters: CauseParameters | None = None
) -> dict[int, Cause]:
    """Find the false minutiae of a template, and the likeliest cause of each.

    Parameters
    ----------
    template : Template
        The extracted minutiae; with its ridge field, which tells where the print ends.
    truth : ImpressionTruth
        The truth, in pixels of the same image.
    parameters : CauseParameters, optional
        Limits.

    Returns
    -------
    dict of int to Cause
        The cause by the index of the false minutia.
    """
    p = parameters or CauseParameters()
    px = template.dpi / STANDARD_DPI
    reach = p.tolerance.distance_px * px
    found = template.minutiae
    paired = assign_minutiae(
        found, truth.minutiae, truth.visible, Tolerance(reach, p.tolerance.turn)
    )
    false = np.setdiff1d(np.arange(len(found)), paired[:, 0])
    if not false.size:
        return {}
    suspect = found.take(false)
    free = np.setdiff1d(np.arange(len(truth.minutiae)), paired[:, 1])
    turned = assign_minutiae(
        suspect, truth.minutiae.take(free), truth.visible[free], Tolerance(reach, math.pi)
    )
    is_turned = np.isin(np.arange(len(suspect)), turned[:, 0])
    others, _ = differences(suspect, found)
    others[np.arange(len(suspect)), false] = np.inf
    applies = {
        Cause.DIRECTION: is_turned,
        Cause.BORDER: distance_to_border(template, suspect.xy) <= p.border_px * px,
        Cause.NO_RIDGES: _nearest(suspect, truth.hidden_xy) < _nearest(suspect, truth.visible_xy),
        Cause.NEAR_ANOTHER: others.min(axis=1) <= p.near_px * px,
        Cause.OTHER: np.ones(len(suspect), dtype=bool),
    }
    first = np.argmax(np.stack([applies[cause] for cause in Cause]), axis=0)
    causes = list(Cause)
    return {int(k): causes[c] for k, c in zip(false, first, strict=True)}


def distance_to_border(template: Template, points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return how far points are from the border of the print, or of the image where that is near.

    Parameters
    ----------
    template : Template
        Tells the size of the image and, by its ridge field, where the print is.
    points : ndarray of float, shape (N, 2)
        Points in pixels.

    Returns
    -------
    ndarray of float64, shape (N,)
        Distances in pixels; 0 outside the print.

    Examples
    --------
    >>> from fpmatch.minutiae import Minutiae, Template
    >>> blank = Template(Minutiae.empty(), width=100, height=60)
    >>> distance_to_border(blank, np.array([[50.0, 20.0], [97.0, 30.0]])).tolist()
    [20.0, 3.0]
    """
    x, y = np.asarray(points, dtype=np.float64).T
    to_edge = np.min([x, y, template.width - x, template.height - y], axis=0).clip(min=0.0)
    if template.field is None or template.field.mask.all():
        return np.asarray(to_edge)
    return np.asarray(np.minimum(to_edge, _distance_to_empty_cells(template.field, x, y)))


def _distance_to_empty_cells(
    field: RidgeField, x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.float64]:
    rows, columns = np.nonzero(~field.mask)
    half = field.step / 2
    across = np.abs(x[:, None] - (columns + 0.5) * field.step) - half
    down = np.abs(y[:, None] - (rows + 0.5) * field.step) - half
    return np.asarray(np.hypot(across.clip(min=0.0), down.clip(min=0.0)).min(axis=1))


def _nearest(minutiae: Minutiae, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance from each minutia to the nearest point; infinite where there is none."""
    apart = minutiae.xy.astype(np.float64)[:, None] - points[None]
    return np.asarray(np.hypot(*apart.transpose(2, 0, 1)).min(axis=1, initial=np.inf))
