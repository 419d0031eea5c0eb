"""The errors of many transforms in a few figures."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.ground_truth.transform_error import TransformError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_FIELDS: Final = len(fields(TransformError))


@dataclass(frozen=True, slots=True)
class TransformLimits:
    """Set what counts as in place.

    Parameters
    ----------
    rotation_deg : float
        Largest error of a rotation, in degrees.
    shift_px : float
        Largest error of a shift, in pixels at 500 dpi.
    """

    rotation_deg: float = 2.0
    shift_px: float = 4.0


@dataclass(frozen=True, slots=True)
class TransformSummary:
    """Hold the errors of some judged pairs in a few figures; NaN where there are none.

    Parameters
    ----------
    judged : int
        Number of pairs.
    match : float
        Share of these that are decided a match.
    rotation_in_limits, shift_in_limits, in_place : float
        Shares with the rotation, the shift, and both within limits; a pair without a transform
        has neither.
    rotation_deg, rotation_deg_p95 : float
        Median, and 95 in 100, of the rotation's error in degrees.
    shift_px, shift_px_p95 : float
        The same of the shift's error, in pixels at 500 dpi.
    scale_percent, scale_percent_p95 : float
        The same of the scale's error, in percent.
    residual_px, least_residual_px : float
        Medians of what the found transform, and the best similarity, leave over the overlap.
    """

    judged: int
    match: float
    rotation_in_limits: float
    shift_in_limits: float
    in_place: float
    rotation_deg: float
    rotation_deg_p95: float
    shift_px: float
    shift_px_p95: float
    scale_percent: float
    scale_percent_p95: float
    residual_px: float
    least_residual_px: float


def summarise_transforms(
    errors: Sequence[TransformError], limits: TransformLimits | None = None
) -> TransformSummary:
    """Summarise the errors of some pairs.

    Examples
    --------
    >>> from dataclasses import replace
    >>> near = TransformError(True, 0.5, 1.0, 1.01, 2.0, 1.5)
    >>> summary = summarise_transforms([near, replace(near, shift_px=9.0)])
    >>> summary.match, summary.in_place, summary.shift_px
    (1.0, 0.5, 5.0)
    """
    p = limits or TransformLimits()
    table = np.array([astuple(error) for error in errors], dtype=np.float64)
    match, rotation, shift, scale, residual, least = table.reshape(len(errors), _FIELDS).T
    turned_well, shifted_well = rotation <= p.rotation_deg, shift <= p.shift_px
    percent = 100 * np.abs(scale - 1)
    return TransformSummary(
        judged=len(errors),
        match=_mean(match),
        rotation_in_limits=_mean(turned_well),
        shift_in_limits=_mean(shifted_well),
        in_place=_mean(turned_well & shifted_well),
        rotation_deg=_quantile(rotation, 0.5),
        rotation_deg_p95=_quantile(rotation, 0.95),
        shift_px=_quantile(shift, 0.5),
        shift_px_p95=_quantile(shift, 0.95),
        scale_percent=_quantile(percent, 0.5),
        scale_percent_p95=_quantile(percent, 0.95),
        residual_px=_quantile(residual, 0.5),
        least_residual_px=_quantile(least, 0.5),
    )


def _mean(values: NDArray[np.float64] | NDArray[np.bool_]) -> float:
    return float(np.mean(values)) if values.size else float("nan")


def _quantile(values: NDArray[np.float64], share: float) -> float:
    known = values[np.isfinite(values)]
    return float(np.quantile(known, share)) if known.size else float("nan")
