"""Error versus discard: false non-matches where the prints of lowest quality are discarded.

If quality predicts matching, the prints that do not match are discarded first.

References
----------
Grother, Tabassi, "Performance of biometric quality measures", IEEE PAMI 29 (2007).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.engine.workers import Progress, no_progress
from fpmatch.errors import DatasetError, FpmatchError
from fpmatch.evaluation.extraction import ExtractedSet, Extraction, attempt_each_image
from fpmatch.evaluation.rates import threshold_at_fmr
from fpmatch.evaluation.run import evaluate_templates
from fpmatch.image.assess import assess
from fpmatch.image.quality.print_quality import PrintQuality

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.evaluation.dataset import Dataset
    from fpmatch.evaluation.report import SetResult

SHARES: Final = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4)
"""Shares of the prints that are discarded."""
FMR: Final = 0.001
POOLED: Final = "pooled"


@dataclass(frozen=True, slots=True)
class DiscardCurve:
    """Hold the curve of one database.

    Parameters
    ----------
    name : str
        The database.
    prints : int
        Its prints.
    below : tuple of int
        For each share, the quality below which all prints are discarded.
    genuine : tuple of int
        The genuine pairs that remain.
    lost : tuple of int
        Those of them that do not exceed the threshold, which is the same for all shares.
    """

    name: str
    prints: int
    below: tuple[int, ...]
    genuine: tuple[int, ...]
    lost: tuple[int, ...]

    @property
    def fnmr(self) -> tuple[float, ...]:
        """The false non-match rate for each share; 0 where no genuine pair remains."""
        return tuple(
            lost / max(1, left) for lost, left in zip(self.lost, self.genuine, strict=True)
        )


@dataclass(frozen=True, slots=True, eq=False)
class QualitySample:
    """Hold the quality of a database's prints, and the similarities of their pairs.

    Parameters
    ----------
    name : str
        The database.
    quality : ndarray of int, shape (prints,)
        Quality of each print.
    reasons : mapping of str to int
        Number of prints with each reason for low quality.
    pairs : ndarray of int, shape (N, 2)
        The two prints of each genuine pair.
    genuine, impostor : ndarray of float, shapes (N,) and (M,)
        Similarities.
    """

    name: str
    quality: NDArray[np.int_]
    reasons: Counter[str]
    pairs: NDArray[np.int_]
    genuine: NDArray[np.float64]
    impostor: NDArray[np.float64]


def discard_curve(
    sample: QualitySample, *, fmr: float = FMR, shares: Sequence[float] = SHARES
) -> DiscardCurve:
    """Discard increasing shares of the worst prints, and count the genuine pairs that are lost.

    A pair is discarded with either of its prints. The threshold is that of a false match rate on
    all impostor pairs.

    Raises
    ------
    DatasetError
        If there are too few impostor pairs for the rate.

    Examples
    --------
    >>> pairs = np.array([[0, 1], [1, 2], [0, 2]])
    >>> scores = np.array([9.0, 0.0, 0.0]), np.arange(10) / 10
    >>> sample = QualitySample("three", np.array([80, 70, 5]), Counter(), pairs, *scores)
    >>> discard_curve(sample, fmr=0.1, shares=(0, 0.4)).fnmr
    (0.6666666666666666, 0.0)
    """
    threshold = threshold_at_fmr(sample.impostor, fmr)
    if threshold is None:
        raise DatasetError(f"{sample.name}: too few impostor pairs for an FMR of {fmr:g}")
    worst_first = np.argsort(sample.quality, kind="stable")
    count = len(worst_first)
    below, genuine, lost = [], [], []
    for share in shares:
        discarded = np.zeros(count, bool)
        discarded[worst_first[: round(share * count)]] = True
        kept = ~discarded[sample.pairs].any(axis=1)
        least = sample.quality[~discarded].min(initial=100)
        below.append(int(least) if share else 0)
        genuine.append(int(kept.sum()))
        lost.append(int((sample.genuine[kept] <= threshold).sum()))
    return DiscardCurve(sample.name, count, tuple(below), tuple(genuine), tuple(lost))


def pool(samples: Sequence[QualitySample]) -> QualitySample:
    """Return some databases as one, with one threshold and one order of quality."""
    first = np.cumsum([0, *(len(s.quality) for s in samples)])[:-1]
    return QualitySample(
        POOLED,
        np.concatenate([s.quality for s in samples]),
        sum((s.reasons for s in samples), Counter()),
        np.concatenate([s.pairs + k for s, k in zip(samples, first.tolist(), strict=True)]),
        np.concatenate([s.genuine for s in samples]),
        np.concatenate([s.impostor for s in samples]),
    )


def sample_quality(
    datasets: Sequence[Dataset],
    *,
    workers: int | None = None,
    progress: Progress = no_progress,
) -> list[QualitySample]:
    """Extract, grade and compare the prints of some databases.

    Parameters
    ----------
    datasets : sequence of Dataset
        The databases.
    workers : int, optional
        Processes to use (default: one a core).
    progress : callable
        Called with the stages "extract" and "compare".

    Returns
    -------
    list of QualitySample
        One a database; a print without a template has quality 0.
    """
    found = [
        [attempt.result for attempt in attempts if attempt.result]
        for attempts in attempt_each_image(
            datasets, _assess, stage="extract", workers=workers, progress=progress
        )
    ]
    sets = [
        ExtractedSet(dataset, tuple(extraction for extraction, _ in row))
        for dataset, row in zip(datasets, found, strict=True)
    ]
    report = evaluate_templates(sets, workers=workers, progress=progress)
    return [
        _sample(row, [quality for _, quality in of_set])
        for row, of_set in zip(report.sets, found, strict=True)
    ]


def curves_as_json(samples: Sequence[QualitySample], *, fmr: float = FMR) -> dict[str, Any]:
    """Return the curves of some databases and of all together, ready for JSON."""
    every = [*samples, pool(samples)] if len(samples) > 1 else list(samples)
    return {
        "fmr": fmr,
        "shares": list(SHARES),
        "sets": [
            {
                **asdict(discard_curve(sample, fmr=fmr)),
                "quality": np.quantile(sample.quality, (0.05, 0.5, 0.95)).round(1).tolist(),
                "reasons": sample.reasons,
            }
            for sample in every
        ],
    }


def _assess(path: Path, dpi: float | None) -> tuple[Extraction, PrintQuality]:
    try:
        found = assess(path, dpi)
    except FpmatchError as error:
        return Extraction(None, str(error), 0.0), PrintQuality(0)
    none = "" if len(found.template.minutiae) else f"{path}: no minutiae found"
    return Extraction(None if none else found.template, none, 0.0), found.quality


def _sample(row: SetResult, qualities: Sequence[PrintQuality]) -> QualitySample:
    genuine = row.pairs.genuine
    scores = row.outcomes["similarity"].astype(np.float64)
    reasons = Counter(reason.code for quality in qualities for reason in quality.reasons)
    return QualitySample(
        row.name,
        np.array([quality.score for quality in qualities]),
        reasons,
        np.column_stack([row.pairs.probe, row.pairs.reference])[genuine],
        scores[genuine],
        scores[~genuine],
    )
