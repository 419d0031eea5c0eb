"""Errors of a matcher's transforms of genuine pairs, and their summary."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.gallery.batch.decision import matches
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.ground_truth.truth import ImpressionTruth
    from fpmatch.lab.evaluation.report.results import SetResult

MIN_COMMON: Final = 12
MAX_ROTATION_DEG: Final = 2.0  # errors of a transform in place; pixels at 500 dpi
MAX_SHIFT_PX: Final = 4.0


@dataclass(frozen=True, slots=True)
class TransformError:
    """The error of one transform; NaN where none was found.

    The true transform is ``reference.after(probe.inverse())`` of the two prints' own transforms.
    The overlap is sampled at the true minutiae that are visible in both: `shift_px` is the distance
    between its mapped and its true middle, and `residual_px` the root mean square distance between
    mapped and true positions. `least_residual_px` is that of the best similarity, which is not 0
    because skin stretches. The rotation's error is 0 to 180 degrees, the scale's the ratio of found
    to true.
    """

    match: bool
    rotation_deg: float
    shift_px: float
    scale: float
    residual_px: float
    least_residual_px: float


def measure_transform(
    measured: Similarity | None,
    probe: ImpressionTruth,
    reference: ImpressionTruth,
    *,
    match: bool = True,
    dpi: float = STANDARD_DPI,
) -> TransformError:
    """Measure one transform, from the probe's pixels to the reference's, against the truth.

    The two prints have at least two true minutiae in common; `dpi` is that of the reference.
    """
    p, q = common_minutiae(probe, reference)
    px = STANDARD_DPI / dpi
    least = px * _residual(Similarity.fit(p, q), p, q)
    if measured is None:
        return TransformError(match, *(math.nan,) * 4, least)
    true = reference.transform.after(probe.transform.inverse())
    middle = p.mean(axis=0, keepdims=True)
    return TransformError(
        match=match,
        rotation_deg=abs(Similarity(rotation=measured.rotation - true.rotation).rotation_deg),
        shift_px=px * float(np.hypot(*(measured.apply(middle) - true.apply(middle))[0])),
        scale=measured.scale / true.scale,
        residual_px=px * _residual(measured, p, q),
        least_residual_px=least,
    )


def common_minutiae(
    probe: ImpressionTruth, reference: ImpressionTruth
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the positions in each print of the minutiae visible in both, (N, 2) each."""
    seen = [np.flatnonzero(truth.visible) for truth in (probe, reference)]
    _, i, j = np.intersect1d(
        probe.master[seen[0]], reference.master[seen[1]], assume_unique=True, return_indices=True
    )
    return probe.visible_xy[i], reference.visible_xy[j]


def measure_transforms(
    result: SetResult, truths: Sequence[ImpressionTruth], matcher: str
) -> list[TransformError]:
    """Measure the transforms of a database's genuine pairs that have enough in common.

    Pairs with fewer than `MIN_COMMON` true minutiae that are visible in both prints are not judged.
    """
    errors = []
    decided = matches(matcher, result.outcomes["similarity"])
    templates = [extraction.template for extraction in result.extracted.extractions]
    for k in np.flatnonzero(result.pairs.genuine):
        i, j = int(result.pairs.probe[k]), int(result.pairs.reference[k])
        if len(common_minutiae(truths[i], truths[j])[0]) < MIN_COMMON:
            continue
        outcome, reference = result.outcomes[k], templates[j]
        scale, degrees, tx, ty = (float(outcome[m]) for m in ("scale", "rotation_deg", "tx", "ty"))
        transform = None if math.isnan(scale) else Similarity(scale, math.radians(degrees), tx, ty)
        dpi = STANDARD_DPI if reference is None else reference.dpi
        match = transform is not None and bool(decided[k])
        errors.append(measure_transform(transform, truths[i], truths[j], match=match, dpi=dpi))
    return errors


def _residual(transform: Similarity, p: NDArray[np.float64], q: NDArray[np.float64]) -> float:
    return float(np.sqrt(((transform.apply(p) - q) ** 2).sum(axis=1).mean()))


@dataclass(frozen=True, slots=True)
class TransformSummary:
    """Summarise the errors of some judged pairs; NaN where there are none.

    `match` is the share of pairs that are decided a match, `in_place` that of pairs with rotation
    and shift within `MAX_ROTATION_DEG` and `MAX_SHIFT_PX`; a pair without a transform has neither.
    Errors are medians and 95th percentiles, residuals medians; lengths at 500 dpi.
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


def summarise_transforms(errors: Sequence[TransformError]) -> TransformSummary:
    """Summarise the errors of some pairs."""
    table = np.array([astuple(error) for error in errors], dtype=np.float64).reshape(-1, 6)
    match, rotation, shift, scale, residual, least = table.T
    turned_well, shifted_well = rotation <= MAX_ROTATION_DEG, shift <= MAX_SHIFT_PX
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
    return float(np.mean(values)) if values.size else math.nan


def _quantile(values: NDArray[np.float64], share: float) -> float:
    known = values[np.isfinite(values)]
    return float(np.quantile(known, share)) if known.size else math.nan
