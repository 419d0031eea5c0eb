"""Comparison of two runs over the same pairs of prints, pair by pair.

Whether rates differ beyond chance is estimated by the bootstrap over fingers, with the same draws
for both runs: a finger that is hard in one run is hard in the other, so the difference scatters
less than either rate. Decisions on genuine pairs, each run at its own threshold for one false match
rate, are compared by McNemar's exact test, which takes the pairs for independent trials and so
finds differences too easily where a finger has many impressions.

References
----------
McNemar, "Note on the sampling error of the difference between correlated proportions or
percentages", Psychometrika 12 (1947).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.rates.bootstrap import BOOTSTRAPPED, DEFAULT_BOOTSTRAP, bootstrap_rates
from fpmatch.lab.evaluation.rates.error_rates import FMR_LIMITS, error_rates, threshold_at_fmr
from fpmatch.lab.evaluation.rates.intervals import (
    MIN_FINGERS,
    ExactBound,
    Interval,
    combined,
    exact_bound,
    interval_of,
)
from fpmatch.lab.evaluation.rates.scores_set import Trials

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores_set import ScoresSet

DECISION_FMRS: Final = (FMR_LIMITS["fmr1000"], FMR_LIMITS["fmr100"])
"""Decisions, and errors by quality, are those at the first of these that the pairs allow."""


NO_CHANGE: Final = Interval(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class RateDifference:
    """A rate before and now, over the pairs that both runs compared.

    `interval` is the 95 % interval of ``now - before``; None where there are too few fingers.
    `bound` is its basis where no draw changes the rate though the order of the scores changed: 0 of
    its trials changed.
    """

    rate: str
    before: float
    now: float
    interval: Interval | None
    bound: ExactBound | None = None

    @property
    def verdict(self) -> str:
        """Whether the rate got better or worse."""
        if self.now == self.before and self.interval == NO_CHANGE:
            return "no change"
        if self.interval is None:
            return "too few fingers to tell"
        if not self.interval.excludes_zero:
            return "within chance"
        return "better" if self.now < self.before else "worse"


@dataclass(frozen=True, slots=True)
class ChangedPair:
    """Name a genuine pair that only one run accepts: its database and its two images."""

    set: str
    probe: str
    reference: str


@dataclass(frozen=True, slots=True)
class DecisionChange:
    """The changed decisions on genuine pairs, all databases under one threshold.

    Either run has its threshold at the false match rate `fmr`. `gained` and `lost` are the pairs
    that only the later, and only the earlier run accepts. `mcnemar_p` is the p-value of McNemar's
    exact test: the probability of a split as uneven if neither run is better.
    """

    fmr: float
    genuine: int
    gained: tuple[ChangedPair, ...]
    lost: tuple[ChangedPair, ...]
    mcnemar_p: float


@dataclass(frozen=True, slots=True)
class SetComparison:
    """The comparison of two runs over one database, or over all: pairs and rates."""

    name: str
    pairs: int
    differences: tuple[RateDifference, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the comparison as JSON values."""
        rates = {
            d.rate: {
                "before": d.before,
                "now": d.now,
                "change_interval": d.interval,
                "change_bound": d.bound and asdict(d.bound),
                "verdict": d.verdict,
            }
            for d in self.differences
        }
        return {"name": self.name, "pairs": self.pairs, **rates}


@dataclass(frozen=True, slots=True)
class RunComparison:
    """The comparison of the runs of two matchers.

    Pairs that just one of them compared are left out; `identical` counts those whose similarity is
    the same in both, to the last bit. `decisions` is None where there are too few pairs for a
    threshold.
    """

    before: str
    now: str
    only_before: int
    only_now: int
    identical: int
    sets: tuple[SetComparison, ...]
    mean: SetComparison
    pooled: SetComparison
    decisions: DecisionChange | None

    def titles(self) -> tuple[str, str]:
        """Return the column titles of the two runs: their matchers, where these differ."""
        return ("before", "now") if self.before in {"", self.now} else (self.before, self.now)

    def shown(self) -> list[tuple[SetComparison, tuple[RateDifference, ...]]]:
        """Return the rates that tables have: the EER of each database, and all of mean and pooled.

        Of one database these are all its rates.
        """
        if len(self.sets) == 1:
            return [(self.sets[0], self.sets[0].differences)]
        each = [(one, one.differences[:1]) for one in self.sets]
        return each + [(one, one.differences) for one in (self.mean, self.pooled)]

    def as_json(self) -> dict[str, Any]:
        """Return the comparison as JSON values; rates as fractions."""
        return {
            **asdict(self),
            "sets": [one.as_json() for one in self.sets],
            "mean": self.mean.as_json(),
            "pooled": self.pooled.as_json(),
        }


@dataclass(frozen=True, slots=True, eq=False)
class _Common:
    """The pairs that both runs compared, in one order."""

    now: ScoresSet
    rows: NDArray[np.intp]  # of `now`
    before: Trials
    after: Trials


def compare_runs(
    before: Sequence[ScoresSet],
    now: Sequence[ScoresSet],
    *,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
) -> RunComparison:
    """Compare two runs over the same prints, on the pairs that both have, identified by names.

    Raises a `DatasetError` if they have no genuine or no impostor pair in common.
    """
    earlier = {one.name: one for one in before}
    common = [_in_common(earlier[one.name], one) for one in now if one.name in earlier]
    if not common:
        raise DatasetError(
            "the two runs have no database in common: "
            f"{', '.join(sorted(earlier))}; {', '.join(one.name for one in now)}"
        )
    common = [c for c in common if c.after.genuine.any() and not c.after.genuine.all()]
    if not common:
        raise DatasetError("the two runs have no genuine and impostor pairs in common")
    rates_before, rates_now = (
        bootstrap_rates(trials, bootstrap, seed)
        for trials in ([c.before for c in common], [c.after for c in common])
    )
    enough = [c.after.fingers >= MIN_FINGERS for c in common]
    sets = tuple(
        _compare(c.now.name, [c], rates_now.sets[k] - rates_before.sets[k] if enough[k] else None)
        for k, c in enumerate(common)
    )
    shared = sum(one.pairs for one in sets)
    of_mean = of_pooled = None
    if all(enough):
        of_mean = rates_now.mean - rates_before.mean
        of_pooled = rates_now.pooled - rates_before.pooled
    similarity_before, similarity_now, _ = _pooled(common)
    return RunComparison(
        before=before[0].matcher,
        now=now[0].matcher,
        only_before=sum(one.probe.size for one in before) - shared,
        only_now=sum(one.probe.size for one in now) - shared,
        identical=int(np.count_nonzero(similarity_now == similarity_before)),
        sets=sets,
        mean=_mean(sets, of_mean),
        pooled=_compare("pooled", common, of_pooled),
        decisions=_decisions(common),
    )


def have_common_pairs(before: Sequence[ScoresSet], now: Sequence[ScoresSet]) -> bool:
    """Return whether `compare_runs` finds genuine and impostor pairs in both."""
    earlier = {one.name: one for one in before}
    common = [_in_common(earlier[one.name], one) for one in now if one.name in earlier]
    return any(c.after.genuine.any() and not c.after.genuine.all() for c in common)


def _in_common(before: ScoresSet, now: ScoresSet) -> _Common:
    """Find the pairs of one database that both runs compared, whichever print came first."""
    number = {name: k for k, name in enumerate(now.prints)}
    renumbered = np.array([number.get(name, -1) for name in before.prints], np.intp)
    known = (renumbered[before.probe] >= 0) & (renumbered[before.reference] >= 0)
    earlier = np.flatnonzero(known)
    size = len(now.prints)
    keys = _keys(renumbered[before.probe[earlier]], renumbered[before.reference[earlier]], size)
    _, at_before, at_now = np.intersect1d(
        keys, _keys(now.probe, now.reference, size), return_indices=True
    )
    t, count = now.trials, at_now.size
    both = np.concatenate([t.probe[at_now], t.reference[at_now]])
    fingers, flat = np.unique(both, return_inverse=True)
    trials = Trials(t.similarity[at_now], flat[:count], flat[count:], int(fingers.size))
    similarity_before = before.trials.similarity[earlier[at_before]]
    return _Common(now, at_now, replace(trials, similarity=similarity_before), trials)


def _keys(probe: NDArray[np.intp], reference: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    return np.asarray(np.minimum(probe, reference) * size + np.maximum(probe, reference))


def _pooled(
    common: Sequence[_Common],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return similarities before and now, and which pairs are genuine, of all databases."""
    return (
        np.concatenate([c.before.similarity for c in common]),
        np.concatenate([c.after.similarity for c in common]),
        np.concatenate([c.after.genuine for c in common]),
    )


def _compare(
    name: str, common: Sequence[_Common], draws: NDArray[np.float64] | None
) -> SetComparison:
    """Compare the rates; `draws` are bootstrapped differences, None with too few fingers."""
    from scipy.stats import rankdata  # noqa: PLC0415

    before, now, genuine = _pooled(common)
    was, is_now = (error_rates(s[genuine], s[~genuine]) for s in (before, now))
    same_order = np.array_equal(rankdata(before), rankdata(now))
    differences = []
    for column, rate in enumerate(BOOTSTRAPPED):
        if getattr(is_now, rate) is not None:
            interval, bound = _interval(draws, column), None
            if interval == NO_CHANGE and not same_order:
                bound = exact_bound(rate, [c.after for c in common])
            differences.append(
                _difference(rate, getattr(was, rate), getattr(is_now, rate), interval, bound)
            )
    return SetComparison(name, int(genuine.size), tuple(differences))


def _mean(sets: Sequence[SetComparison], draws: NDArray[np.float64] | None) -> SetComparison:
    """Return the mean of each rate that all databases have; `draws` as for `_compare`."""
    differences = []
    for column, rate in enumerate(BOOTSTRAPPED):
        of_sets = [d for one in sets for d in one.differences if d.rate == rate]
        if len(of_sets) == len(sets):
            before = float(np.mean([d.before for d in of_sets]))
            now = float(np.mean([d.now for d in of_sets]))
            interval, bound = _interval(draws, column), None
            bounds = [d.bound for d in of_sets if d.bound]
            if interval == NO_CHANGE and bounds:
                bound = combined(bounds, mean=True)
            differences.append(_difference(rate, before, now, interval, bound))
    return SetComparison("mean", sum(one.pairs for one in sets), tuple(differences))


def _difference(
    rate: str, before: float, now: float, interval: Interval | None, bound: ExactBound | None
) -> RateDifference:
    """Return a difference; with a bound, its interval is what 0 of the bound's trials allow."""
    if bound is not None:
        highest = bound.interval(0.0).high
        interval = Interval(-highest, highest)
    return RateDifference(rate, before, now, interval, bound)


def _interval(draws: NDArray[np.float64] | None, column: int) -> Interval | None:
    return None if draws is None else interval_of(draws[:, column])


def _decisions(common: Sequence[_Common]) -> DecisionChange | None:
    from scipy.stats import binomtest  # noqa: PLC0415

    before, now, genuine = _pooled(common)
    for fmr in DECISION_FMRS:
        at_before, at_now = (threshold_at_fmr(s[~genuine], fmr) for s in (before, now))
        if at_before is not None and at_now is not None:
            break
    else:
        return None
    was, accepted = (before > at_before) & genuine, (now > at_now) & genuine
    gained = tuple(_pair(common, k) for k in np.flatnonzero(accepted & ~was).tolist())
    lost = tuple(_pair(common, k) for k in np.flatnonzero(was & ~accepted).tolist())
    changed = len(gained) + len(lost)
    p_value = float(binomtest(len(lost), changed).pvalue) if changed else 1.0
    return DecisionChange(fmr, int(genuine.sum()), gained, lost, p_value)


def _pair(common: Sequence[_Common], row: int) -> ChangedPair:
    """Name the pair at a row of the pairs of all databases."""
    for c in common:
        if row < c.rows.size:
            k, prints = c.rows[row], c.now.prints
            return ChangedPair(c.now.name, prints[c.now.probe[k]], prints[c.now.reference[k]])
        row -= c.rows.size
    raise IndexError(row)
