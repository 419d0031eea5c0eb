"""Two runs over the same pairs of prints, compared pair by pair.

Whether a difference of rates lies outside chance is told by drawing fingers anew, the same for both
runs: what makes a finger hard for one makes it hard for the other, so the difference scatters less
than either rate. Decisions on genuine pairs, each run at its own threshold for one false match
rate, are compared by McNemar's exact test, which takes the pairs for independent trials and so
finds differences too easily where a finger has many impressions.

References
----------
McNemar, "Note on the sampling error of the difference between correlated proportions or
percentages", Psychometrika 12 (1947).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.evaluation.bootstrap import RESAMPLED, Trials, resample_rates
from fpmatch.evaluation.intervals import DEFAULT_RESAMPLES, MIN_FINGERS, interval_of
from fpmatch.evaluation.rates import FMR_LIMITS, error_rates, threshold_at_fmr
from fpmatch.evaluation.run_comparison_result import (
    ChangedPair,
    DecisionChange,
    PairedComparison,
    PairedSet,
    RateDifference,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.scores_reader import ScoresSet

DECISION_LIMITS: Final = ("fmr1000", "fmr100")
"""Decisions are compared at the first of these that the pairs allow."""


@dataclass(frozen=True, slots=True, eq=False)
class _Common:
    """Hold the pairs that both runs compared, in one order."""

    now: ScoresSet
    rows: NDArray[np.intp]
    trials_before: Trials
    trials_now: Trials


def compare_runs(
    before: Sequence[ScoresSet],
    now: Sequence[ScoresSet],
    *,
    resamples: int = DEFAULT_RESAMPLES,
    seed: int = 0,
) -> PairedComparison:
    """Compare two runs over the same prints.

    Parameters
    ----------
    before, now : sequence of ScoresSet
        The databases of either run; those of one name and images of one name are the same.
    resamples, seed : int
        Draws of fingers for the intervals, and what makes them.

    Returns
    -------
    PairedComparison
        The comparison, over the pairs that both have.

    Raises
    ------
    DatasetError
        If they have no genuine or no impostor pair in common.
    """
    earlier = {one.name: one for one in before}
    common = [_in_common(earlier[one.name], one) for one in now if one.name in earlier]
    if not common:
        raise DatasetError(
            "the two runs have no database in common: "
            f"{', '.join(sorted(earlier))}; {', '.join(one.name for one in now)}"
        )
    common = [c for c in common if c.trials_now.genuine.any() and not c.trials_now.genuine.all()]
    if not common:
        raise DatasetError("the two runs have no genuine and impostor pairs in common")
    were = resample_rates([c.trials_before for c in common], resamples, seed)
    are = resample_rates([c.trials_now for c in common], resamples, seed)
    enough = [c.trials_now.fingers >= MIN_FINGERS for c in common]
    sets = tuple(
        _paired_set(c.now.name, [c], are.sets[k] - were.sets[k], enough[k])
        for k, c in enumerate(common)
    )
    shared = sum(one.pairs for one in sets)
    return PairedComparison(
        before=before[0].matcher,
        now=now[0].matcher,
        only_before=sum(one.probe.size for one in before) - shared,
        only_now=sum(one.probe.size for one in now) - shared,
        alike=sum(
            int(np.count_nonzero(c.trials_now.similarity == c.trials_before.similarity))
            for c in common
        ),
        sets=sets,
        mean=_mean(sets, are.mean - were.mean, all(enough)),
        pooled=_paired_set("pooled", common, are.pooled - were.pooled, all(enough)),
        decisions=_decisions(common),
    )


def _in_common(before: ScoresSet, now: ScoresSet) -> _Common:
    """Find the pairs of one database that both runs compared, whichever print came first."""
    number = {name: k for k, name in enumerate(now.prints)}
    renumbered = np.array([number.get(name, -1) for name in before.prints], np.intp)
    known = (renumbered[before.probe] >= 0) & (renumbered[before.reference] >= 0)
    earlier = np.flatnonzero(known)
    size = len(now.prints)
    keys = _keys(renumbered[before.probe[earlier]], renumbered[before.reference[earlier]], size)
    _, there, here = np.intersect1d(
        keys, _keys(now.probe, now.reference, size), assume_unique=True, return_indices=True
    )
    fingers, flat = np.unique(
        np.concatenate([now.trials.probe[here], now.trials.reference[here]]), return_inverse=True
    )
    trials = Trials(
        similarity=now.trials.similarity[here],
        probe=flat[: here.size],
        reference=flat[here.size :],
        fingers=int(fingers.size),
    )
    were = replace(trials, similarity=before.trials.similarity[earlier[there]])
    return _Common(now, here, were, trials)


def _keys(probe: NDArray[np.intp], reference: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    keys: NDArray[np.intp] = np.minimum(probe, reference) * size + np.maximum(probe, reference)
    return keys


def _paired_set(
    name: str, common: Sequence[_Common], draws: NDArray[np.float64], enough: bool
) -> PairedSet:
    genuine = np.concatenate([c.trials_now.genuine for c in common])
    now = np.concatenate([c.trials_now.similarity for c in common])
    before = np.concatenate([c.trials_before.similarity for c in common])
    rates_now = error_rates(now[genuine], now[~genuine])
    rates_before = error_rates(before[genuine], before[~genuine])
    changes = [
        RateDifference(
            rate=rate,
            before=getattr(rates_before, rate),
            now=getattr(rates_now, rate),
            interval=interval_of(draws[:, column]) if enough else None,
        )
        for column, rate in enumerate(RESAMPLED)
        if getattr(rates_now, rate) is not None
    ]
    return PairedSet(name, int(genuine.size), tuple(changes))


def _mean(sets: Sequence[PairedSet], draws: NDArray[np.float64], enough: bool) -> PairedSet:
    changes = []
    for column, rate in enumerate(RESAMPLED):
        found = [change for one in sets for change in one.changes if change.rate == rate]
        if len(found) == len(sets):
            changes.append(
                RateDifference(
                    rate=rate,
                    before=float(np.mean([change.before for change in found])),
                    now=float(np.mean([change.now for change in found])),
                    interval=interval_of(draws[:, column]) if enough else None,
                )
            )
    return PairedSet("mean", sum(one.pairs for one in sets), tuple(changes))


def _decisions(common: Sequence[_Common]) -> DecisionChange | None:
    from scipy.stats import binomtest  # noqa: PLC0415

    genuine = np.concatenate([c.trials_now.genuine for c in common])
    now = np.concatenate([c.trials_now.similarity for c in common])
    before = np.concatenate([c.trials_before.similarity for c in common])
    for name in DECISION_LIMITS:
        limit = FMR_LIMITS[name]
        at_now = threshold_at_fmr(now[~genuine], limit)
        at_before = threshold_at_fmr(before[~genuine], limit)
        if at_now is not None and at_before is not None:
            break
    else:
        return None
    accepted, was = (now > at_now) & genuine, (before > at_before) & genuine
    gained = tuple(_pair(common, int(k)) for k in np.flatnonzero(accepted & ~was))
    lost = tuple(_pair(common, int(k)) for k in np.flatnonzero(was & ~accepted))
    changed = len(gained) + len(lost)
    p_value = float(binomtest(len(lost), changed).pvalue) if changed else 1.0
    return DecisionChange(limit, int(genuine.sum()), gained, lost, p_value)


def _pair(common: Sequence[_Common], row: int) -> ChangedPair:
    """Name the pair at a row of all databases' pairs one after the other."""
    for c in common:
        if row < c.rows.size:
            k, prints = c.rows[row], c.now.prints
            return ChangedPair(c.now.name, prints[c.now.probe[k]], prints[c.now.reference[k]])
        row -= c.rows.size
    raise IndexError(row)
