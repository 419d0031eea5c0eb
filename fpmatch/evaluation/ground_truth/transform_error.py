"""How far a matcher's transforms of genuine pairs are from the true ones."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.decision import decide
from fpmatch.minutiae import STANDARD_DPI
from fpmatch.pointset.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.ground_truth.truth import ImpressionTruth
    from fpmatch.evaluation.report import SetResult

MIN_COMMON: Final = 12
_NAN: Final = float("nan")


@dataclass(frozen=True, slots=True)
class TransformError:
    """Hold how far one transform is from the true one; NaN where none was found.

    True is ``reference.after(probe.inverse())`` of the two prints' own transforms. The overlap is
    sampled at the true minutiae to be seen in both.

    Parameters
    ----------
    match : bool
        Whether the decision is a match, as `fpmatch.verify` decides by default.
    rotation_deg : float
        Error of the rotation, 0 to 180 degrees.
    shift_px : float
        How far the middle of the overlap is mapped from where it truly lies.
    scale : float
        Found scale by the true one.
    residual_px : float
        Root mean square distance, over the overlap, of what is mapped from where it truly lies.
    least_residual_px : float
        What the best similarity would leave there, because skin stretches.
    """

    match: bool
    rotation_deg: float
    shift_px: float
    scale: float
    residual_px: float
    least_residual_px: float


def measure_transform(
    found: Similarity | None,
    probe: ImpressionTruth,
    reference: ImpressionTruth,
    *,
    match: bool = True,
    dpi: float = STANDARD_DPI,
) -> TransformError:
    """Measure one transform against the truth.

    Parameters
    ----------
    found : Similarity or None
        The transform found, from the probe's pixels to the reference's.
    probe, reference : ImpressionTruth
        The truth about the two; they have at least two minutiae in common.
    match : bool
        The decision.
    dpi : float
        Resolution of the reference, by which lengths are brought to 500 dpi.

    Returns
    -------
    TransformError
        The error.
    """
    p, q = common_minutiae(probe, reference)
    px = STANDARD_DPI / dpi
    least = px * _residual(Similarity.fit(p, q), p, q)
    if found is None:
        return TransformError(match, _NAN, _NAN, _NAN, _NAN, least)
    true = reference.transform.after(probe.transform.inverse())
    middle = p.mean(axis=0, keepdims=True)
    return TransformError(
        match=match,
        rotation_deg=abs(Similarity(rotation=found.rotation - true.rotation).rotation_deg),
        shift_px=px * float(np.hypot(*(found.apply(middle) - true.apply(middle))[0])),
        scale=found.scale / true.scale,
        residual_px=px * _residual(found, p, q),
        least_residual_px=least,
    )


def common_minutiae(
    probe: ImpressionTruth, reference: ImpressionTruth
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the minutiae that can be seen in both prints lie in either, (N, 2) each."""
    seen = [np.flatnonzero(truth.visible) for truth in (probe, reference)]
    _, i, j = np.intersect1d(
        probe.master[seen[0]], reference.master[seen[1]], assume_unique=True, return_indices=True
    )
    return probe.visible_xy[i], reference.visible_xy[j]


def measure_transforms(
    result: SetResult,
    truths: Sequence[ImpressionTruth],
    matcher: str,
    min_common: int = MIN_COMMON,
) -> list[TransformError]:
    """Measure the transforms of a database's genuine pairs that have enough in common.

    Parameters
    ----------
    result : SetResult
        The comparisons, as `fpmatch.evaluation.run.evaluate` returns them.
    truths : sequence of ImpressionTruth
        The truth about each impression, in the order of the database.
    matcher : str
        The matcher's name; one that has no rule of its own and no calibration finds no match.
    min_common : int
        Pairs with fewer true minutiae to be seen in both prints are not judged; 2 at least.

    Returns
    -------
    list of TransformError
        One a pair judged.
    """
    errors = []
    decided = decide(matcher, result.outcomes["similarity"])
    templates = [extraction.template for extraction in result.extracted.extractions]
    for k in np.flatnonzero(result.pairs.genuine):
        i, j = int(result.pairs.probe[k]), int(result.pairs.reference[k])
        if len(common_minutiae(truths[i], truths[j])[0]) < min_common:
            continue
        found = _transform_of(result.outcomes[k])
        reference = templates[j]
        errors.append(
            measure_transform(
                found,
                truths[i],
                truths[j],
                match=found is not None and bool(decided[k]),
                dpi=STANDARD_DPI if reference is None else reference.dpi,
            )
        )
    return errors


def _transform_of(outcome: NDArray[np.void]) -> Similarity | None:
    scale, degrees, tx, ty = (float(outcome[k]) for k in ("scale", "rotation_deg", "tx", "ty"))
    return None if math.isnan(scale) else Similarity(scale, math.radians(degrees), tx, ty)


def _residual(transform: Similarity, p: NDArray[np.float64], q: NDArray[np.float64]) -> float:
    return float(np.sqrt(((transform.apply(p) - q) ** 2).sum(axis=1).mean()))
