"""Error versus discard: false non-matches where the prints of lowest quality are discarded.

If quality predicts matching, the prints that do not match are discarded first.

References
----------
Grother, Tabassi, "Performance of biometric quality measures", IEEE PAMI 29 (2007).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.rates.error_rates import POOLED, threshold_at_fmr

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores_set import ScoresSet

SHARES: Final = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4)
"""Shares of the prints that are discarded."""
FMR: Final = 0.001


@dataclass(frozen=True, slots=True)
class DiscardCurve:
    """The error-versus-discard curve of one database.

    `name`: the database. `prints`: its prints. `below`: for each share, the quality below which all
    prints are discarded. `genuine`: the genuine pairs that remain. `lost`: those of them that do
    not exceed the threshold, which is the same for all shares.
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
    """The quality of a database's prints, and the similarities of their pairs.

    `name`: the database. `quality` (prints,): quality of each print. `pairs` (N, 2): the two prints
    of each genuine pair. `genuine`, `impostor` (N,): similarities. `reasons`: number of prints with
    each reason for low quality.
    """

    name: str
    quality: NDArray[np.float64]
    pairs: NDArray[np.intp]
    genuine: NDArray[np.float64]
    impostor: NDArray[np.float64]
    reasons: Counter[str] = field(default_factory=Counter)


def discard_curve(
    sample: QualitySample, *, fmr: float = FMR, shares: Sequence[float] = SHARES
) -> DiscardCurve:
    """Discard increasing shares of the worst prints, and count the genuine pairs that are lost.

    A pair is discarded with either of its prints. The threshold is that of a false match rate on
    all impostor pairs. Raises a `DatasetError` if there are too few impostor pairs for the rate.
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
        np.concatenate([s.pairs + k for s, k in zip(samples, first.tolist(), strict=True)]),
        np.concatenate([s.genuine for s in samples]),
        np.concatenate([s.impostor for s in samples]),
        sum((s.reasons for s in samples), Counter()),
    )


def quality_sample(scores: ScoresSet) -> QualitySample | None:
    """Return the quality and the similarities of the prints of a database.

    A print that was never compared has quality 0 unless it is known. None where the quality of
    another print is not known, or there are no genuine pairs.
    """
    if scores.quality is None or not scores.trials.genuine.any():
        return None
    never = np.isin(scores.prints, scores.never_compared)
    quality = np.where(never & np.isnan(scores.quality), 0.0, scores.quality)
    if np.isnan(quality).any():
        return None
    pairs = np.column_stack([scores.probe, scores.reference])[scores.trials.genuine]
    return QualitySample(scores.name, quality, pairs, *scores.split())
