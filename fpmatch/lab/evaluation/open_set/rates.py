"""Error rates of open-set identification, and their intervals.

With N subjects enrolled, a candidate counts where fewer than T others are expected to score as high
by chance, as the search states it. Then

- FPIR(N, T), the false positive identification rate, is the share of the searches without a mate
  that return a candidate;
- FNIR(N, R, T), the false negative identification rate, is the share of the searches with a mate
  that do not return it among the first R candidates.

A search that cannot be done, or a mate that cannot be enrolled, for want of a template is a miss.

References
----------
ISO/IEC 19795-1, "Biometric performance testing and reporting"; Grother, Ngan, Hanaoka, "Face
Recognition Vendor Test, part 2: Identification", NISTIR 8271, for FNIR(N, R, T).
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.lab.evaluation.open_set.searches import LIST_LENGTH
from fpmatch.lab.evaluation.rates.error_rates import fnmr_at_fmr, threshold_at_fmr
from fpmatch.lab.evaluation.rates.intervals import (
    MIN_FINGERS,
    ExactBound,
    Interval,
    drawn_or_exact,
    interval_of,
)
from fpmatch.lab.evaluation.rates.ranked_trials import RankedTrials
from fpmatch.lab.evaluation.rates.scores_set import Trials

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.open_set.searches import Searches

FPIRS: Final = (0.001, 0.005, 0.01)
DET_FPIRS: Final = tuple(np.logspace(-4, 0, 41)[:-1].tolist())
"""At which the DET has points, ten a decade."""
_MOST_CHANCE: Final = 1e12  # more than are in any gallery: of what is not listed


@dataclass(frozen=True, slots=True)
class IdentificationPoint:
    """The FNIR where the FPIR is at most `fpir`, and where the searches state that it is.

    `fnir` is None where there are fewer than 1 / `fpir` searches without a mate; `interval` is its
    95 % interval, and `bound` the basis of that where it has one limit. Candidates count of which
    fewer than `by_chance` others are expected to score as high; `false_positives` is the number of
    different probes without a mate that then have one.

    `stated_fnir` is the FNIR where candidates count by what the searches state: if so many others
    are expected, independently, that any scores as high with the probability `fpir`.
    """

    fpir: float
    fnir: float | None
    interval: Interval | None
    bound: ExactBound | None
    by_chance: float | None
    false_positives: int | None
    stated_fnir: float | None

    @property
    def fpir_ratio(self) -> float | None:
        """The FPIR over the one that the searches state for `by_chance`."""
        return None if self.by_chance is None else self.fpir / -math.expm1(-self.by_chance)

    @property
    def fnir_ratio(self) -> float | None:
        """The FNIR over the stated one, None where that is 0."""
        return self.fnir / self.stated_fnir if self.stated_fnir and self.fnir is not None else None

    def as_json(self) -> dict[str, Any]:
        """Return the point as JSON values, with the ratios and whether they are near 1."""
        ratios = {"fpir": self.fpir_ratio, "fnir": self.fnir_ratio}
        return {
            **asdict(self),
            **{f"{rate}_ratio": ratio for rate, ratio in ratios.items()},
            **{f"{rate}_within_factor_of_two": near(ratio) for rate, ratio in ratios.items()},
        }


def near(ratio: float | None) -> bool | None:
    """Return whether a ratio is within a factor of two of 1, None where there is none."""
    return None if ratio is None else 0.5 <= ratio <= 2.0


@dataclass(frozen=True, slots=True)
class OpenSetRates:
    """The error rates of some searches.

    `points` are at the wanted FPIRs, `det` at those of `DET_FPIRS` that the searches allow.
    `fnir_at_rank` holds the FNIR at rank 1 to 100 without a threshold, `rank_intervals` the 95 %
    interval of each, where there are enough subjects, and `rank_bounds` the basis of those with one
    limit.
    """

    mated: int
    nonmated: int
    points: tuple[IdentificationPoint, ...]
    det: tuple[IdentificationPoint, ...]
    fnir_at_rank: tuple[float, ...]
    rank_intervals: tuple[Interval | None, ...]
    rank_bounds: tuple[ExactBound | None, ...]

    @property
    def loosest(self) -> IdentificationPoint | None:
        """The point of the highest FPIR, of those that have a threshold."""
        known = (point for point in self.points if point.by_chance is not None)
        return max(known, key=lambda point: point.fpir, default=None)

    def as_json(self) -> dict[str, Any]:
        """Return the rates as JSON values."""
        return {
            "mated": self.mated,
            "nonmated": self.nonmated,
            "fnir_at_fpir": [one.as_json() for one in self.points],
            "fnir_at_rank": list(self.fnir_at_rank),
            "rank_intervals": list(self.rank_intervals),
            "rank_bounds": [one and asdict(one) for one in self.rank_bounds],
            "det": [one.as_json() for one in self.det],
        }


def open_set_rates(
    searches: Searches,
    subject: NDArray[np.intp],
    *,
    fpirs: Sequence[float] = FPIRS,
    draws: NDArray[np.int64] | None = None,
) -> OpenSetRates:
    """Compute the error rates of searches.

    `searches`: the searches, or those for presentations of one database. `subject` (P,): the
    subject of each presentation. `fpirs`: the FPIRs of the points, between 0 and 1. `draws` (D, S):
    how often each subject was drawn in each replicate of the bootstrap. Without draws there are no
    intervals. Where fewer than five subjects are drawn, only rates of 0 and 1 have one, with a
    subject as one trial.
    """
    enough = draws is not None and np.count_nonzero(draws.any(axis=0)) >= MIN_FINGERS
    grid = [f for f in DET_FPIRS if f * searches.highest.size >= 1]
    every = [*fpirs, *grid]
    drawn = _drawn_rates(searches, subject, draws, every) if enough and draws is not None else None
    bound = None
    if draws is not None:
        bound = ExactBound("subject", np.unique(subject[searches.mated]).size)
    points = [
        _point(searches, fpir, None if drawn is None else drawn[:, k], bound)
        for k, fpir in enumerate(every)
    ]
    missed = searches.rank[:, np.newaxis] > np.arange(1, LIST_LENGTH + 1)
    at_rank = missed.mean(axis=0).tolist() if len(missed) else []
    intervals: list[Interval | None] = [None] * len(at_rank)
    if enough and draws is not None and len(missed):
        weights = draws[:, subject[searches.mated]]
        with np.errstate(invalid="ignore"):  # a draw without searches has no rate
            shares = (weights @ missed) / weights.sum(axis=1)[:, np.newaxis]
        intervals = [interval_of(share) for share in shares.T]
    of_ranks = [
        drawn_or_exact(fnir, interval, bound)
        for fnir, interval in zip(at_rank, intervals, strict=True)
    ]
    return OpenSetRates(
        mated=len(searches.mated),
        nonmated=len(searches.nonmated),
        points=tuple(points[: len(fpirs)]),
        det=tuple(points[len(fpirs) :]),
        fnir_at_rank=tuple(at_rank),
        rank_intervals=tuple(interval for interval, _ in of_ranks),
        rank_bounds=tuple(used for _, used in of_ranks),
    )


def _rarity(chance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a number that rises as fewer others are expected by chance; finite."""
    return -np.log(np.minimum(chance, _MOST_CHANCE))


def _point(
    searches: Searches,
    fpir: float,
    draws: NDArray[np.float64] | None,
    bound: ExactBound | None,
) -> IdentificationPoint:
    mates, others = _rarity(searches.chance), _rarity(searches.least_chance)
    fnir = fnmr_at_fmr(mates, others, fpir)
    known = fnir is not None and others.size > 0
    threshold = threshold_at_fmr(others, fpir) if known else None
    interval = used = None
    if fnir is not None:
        interval, used = drawn_or_exact(fnir, None if draws is None else interval_of(draws), bound)
    reached = None if threshold is None else searches.nonmated[others > threshold]
    by_chance = None
    if threshold is not None and threshold > -math.log(_MOST_CHANCE):  # some have candidates
        by_chance = math.exp(-threshold)
    return IdentificationPoint(
        fpir=fpir,
        fnir=fnir,
        interval=interval,
        bound=used,
        by_chance=by_chance,
        false_positives=None if reached is None else len(np.unique(reached)),
        stated_fnir=float((searches.chance >= -math.log1p(-fpir)).mean()) if mates.size else None,
    )


def _drawn_rates(
    searches: Searches, subject: NDArray[np.intp], draws: NDArray[np.int64], fpirs: Sequence[float]
) -> NDArray[np.float64]:
    """Return the FNIR at each FPIR, (draws, FPIRs), where a search counts as its subject is drawn.

    The gallery is not drawn.
    """
    mated, nonmated = subject[searches.mated], subject[searches.nonmated]
    trials = Trials(
        similarity=_rarity(np.concatenate([searches.chance, searches.least_chance])),
        probe=np.concatenate([mated, nonmated]),
        reference=np.concatenate([mated, np.full_like(nonmated, -1)]),
        fingers=draws.shape[1],
    )
    ranked = RankedTrials.of(trials, -math.inf)
    rates = np.empty((len(draws), len(fpirs)))
    for rows in np.array_split(np.arange(len(draws)), max(1, len(draws) * len(trials.probe) >> 21)):
        weights = (
            draws[rows][:, trials.probe[ranked.genuine]],
            draws[rows][:, trials.probe[ranked.impostor]],
        )
        drawn, _ = ranked.rates(weights, weights[1].sum(axis=1), fpirs)
        rates[rows] = drawn[:, 1:]
    return rates
