"""Errors by the quality of the prints and by how far they overlap."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.lab.evaluation.rates.error_rates import threshold_at_fmr
from fpmatch.lab.evaluation.rates.error_vs_discard import (
    SHARES,
    DiscardCurve,
    discard_curve,
    pool,
    quality_sample,
)
from fpmatch.lab.evaluation.rates.run_comparison import DECISION_FMRS
from fpmatch.lab.evaluation.report.results import split_scores

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.report.results import RatesReport

QUALITY_EDGES: Final = (0, 20, 40, 60, 80, 100)
OVERLAP_EDGES: Final = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)


@dataclass(frozen=True, slots=True)
class ErrorBin:
    """The genuine pairs whose value is at least `low` and less than `high`.

    `lost` counts those that do not match. The last bin includes its upper limit.
    """

    low: float
    high: float
    genuine: int
    lost: int

    @property
    def fnmr(self) -> float | None:
        """The false non-match rate; None without pairs."""
        return self.lost / self.genuine if self.genuine else None

    def as_json(self) -> dict[str, Any]:
        """Return the bin as JSON values."""
        return {**asdict(self), "fnmr": self.fnmr}


@dataclass(frozen=True, slots=True)
class QualityAnalysis:
    """The errors by quality and by overlap; parts that are not known are empty.

    `curves` are error versus discard curves, one a database and, of several, one of all. The bins
    are those of all genuine pairs: the quality of a pair is that of its worse print, its overlap
    the share of the smaller print that overlaps as the matcher placed them. The threshold has the
    false match rate `fmr`: in a curve that of the database, in bins that of all impostor pairs.
    """

    fmr: float
    curves: tuple[DiscardCurve, ...]
    by_quality: tuple[ErrorBin, ...]
    by_overlap: tuple[ErrorBin, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the analysis as JSON values; rates as fractions."""
        return {
            "fmr": self.fmr,
            "discarded": list(SHARES),
            "error_vs_discard": [{**asdict(c), "fnmr": list(c.fnmr)} for c in self.curves],
            "fnmr_by_quality": [one.as_json() for one in self.by_quality],
            "fnmr_by_overlap": [one.as_json() for one in self.by_overlap],
        }


def analyse_quality(
    report: RatesReport, fmrs: Sequence[float] = DECISION_FMRS
) -> QualityAnalysis | None:
    """Analyse how errors depend on quality and overlap, at the first of `fmrs` that pairs allow.

    None where the scores know neither, or there are too few impostor pairs.
    """
    impostor = split_scores(report.sets)[1]
    fmr = next((one for one in fmrs if threshold_at_fmr(impostor, one) is not None), None)
    if not impostor.size or fmr is None:
        return None
    every = [quality_sample(row.scores) for row in report.sets]
    samples = [one for one in every if one is not None]
    pooled = [pool(samples)] if len(samples) > 1 else []
    usable = [
        one
        for one in [*samples, *pooled]
        if one.impostor.size and threshold_at_fmr(one.impostor, fmr) is not None
    ]
    threshold = threshold_at_fmr(impostor, fmr)
    qualities = [(one.quality[one.pairs].min(axis=1), one.genuine) for one in samples]
    overlaps = [
        (scores.overlap[scores.trials.genuine], scores.split()[0])
        for scores in (row.scores for row in report.sets)
        if scores.overlap is not None
    ]
    analysis = QualityAnalysis(
        fmr=fmr,
        curves=tuple(discard_curve(one, fmr=fmr) for one in usable),
        by_quality=_bins(qualities, QUALITY_EDGES, threshold),
        by_overlap=_bins(overlaps, OVERLAP_EDGES, threshold),
    )
    return analysis if analysis.curves or analysis.by_quality or analysis.by_overlap else None


def _bins(
    samples: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]],
    edges: Sequence[float],
    threshold: float | None,
) -> tuple[ErrorBin, ...]:
    """Count genuine pairs, and those lost, by their values; pairs without a value are left out."""
    if not samples or threshold is None:
        return ()
    values, similarity = (np.concatenate(part) for part in zip(*samples, strict=True))
    counts, _ = np.histogram(values[np.isfinite(values)], edges)
    lost, _ = np.histogram(values[np.isfinite(values) & (similarity <= threshold)], edges)
    if not counts.sum():
        return ()
    limits = zip(edges[:-1], edges[1:], counts.tolist(), lost.tolist(), strict=True)
    return tuple(ErrorBin(*one) for one in limits)
