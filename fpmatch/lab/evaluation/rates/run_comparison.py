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
    Interval,
    interval_json,
    interval_of,
)
from fpmatch.lab.evaluation.rates.scores_set import Trials

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores_set import ScoresSet

DECISION_FMRS: Final = (FMR_LIMITS["fmr1000"], FMR_LIMITS["fmr100"])
"""Decisions are those at the first of these that the pairs allow."""


@dataclass(frozen=True, slots=True)
class RateDifference:
    """A rate before and now, over the pairs that both runs compared.

    `interval` is the 95 % interval of ``now - before``; None where there are too few fingers, or
    where neither the rates nor those of any draw differ, which is then "no change".
    """

    rate: str
    before: float
    now: float
    interval: Interval | None
    verdict: str

    @classmethod
    def of(
        cls, rate: str, before: float, now: float, draws: NDArray[np.float64] | None
    ) -> RateDifference:
        """Return the difference; `draws` are bootstrapped ones, None with too few fingers."""
        interval = None if draws is None else interval_of(draws)
        if draws is not None and now == before and not np.nan_to_num(draws).any():
            return cls(rate, before, now, None, "no change")
        if interval is None:
            return cls(rate, before, now, None, "too few fingers to tell")
        if interval.low <= 0 <= interval.high:
            return cls(rate, before, now, interval, "within chance")
        return cls(rate, before, now, interval, "better" if now < before else "worse")


@dataclass(frozen=True, slots=True)
class DecisionChange:
    """The changed decisions on genuine pairs, all databases under one threshold.

    Either run has its threshold at the false match rate `fmr`. `mcnemar_p` is the p-value of
    McNemar's exact test: the probability of a split as uneven if neither run is better. `gained`
    and `lost` are the pairs that only the later, and only the earlier run accepts: database, probe
    and reference of each.
    """

    mcnemar_p: float
    fmr: float
    genuine: int
    gained: tuple[dict[str, str], ...]
    lost: tuple[dict[str, str], ...]


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
                "change_interval": interval_json(d.interval),
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
            "before": self.before,
            "now": self.now,
            "only_before": self.only_before,
            "only_now": self.only_now,
            "identical": self.identical,
            "sets": [one.as_json() for one in self.sets],
            "mean": self.mean.as_json(),
            "pooled": self.pooled.as_json(),
            "decisions": None if self.decisions is None else asdict(self.decisions),
        }


@dataclass(frozen=True, slots=True, eq=False)
class _Common:
    """The pairs of a database that both runs compared, in one order, and their names."""

    name: str
    before: Trials
    now: Trials
    pairs: list[tuple[str, str]]


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
    common = common_pairs(before, now)
    if not common:
        names = "; ".join(", ".join(sorted(one.name for one in run)) for run in (before, now))
        raise DatasetError(f"the two runs have no genuine and impostor pairs in common: {names}")
    earlier, later = [one.before for one in common], [one.now for one in common]
    rates_before, rates_now = (bootstrap_rates(run, bootstrap, seed) for run in (earlier, later))
    enough = [bootstrap > 0 and one.fingers >= MIN_FINGERS for one in later]
    changes = rates_now.sets - rates_before.sets
    sets = tuple(
        _compare(one.name, [one], changes[k] if enough[k] else None) for k, one in enumerate(common)
    )
    of_mean = of_pooled = None
    if all(enough):
        of_mean = rates_now.mean - rates_before.mean
        of_pooled = rates_now.pooled - rates_before.pooled
    shared = sum(one.pairs for one in sets)
    same = [np.count_nonzero(one.before.similarity == one.now.similarity) for one in common]
    return RunComparison(
        before=before[0].matcher,
        now=now[0].matcher,
        only_before=sum(one.probe.size for one in before) - shared,
        only_now=sum(one.probe.size for one in now) - shared,
        identical=int(sum(same)),
        sets=sets,
        mean=_mean(sets, of_mean),
        pooled=_compare("pooled", common, of_pooled),
        decisions=_decisions(common),
    )


def common_pairs(before: Sequence[ScoresSet], now: Sequence[ScoresSet]) -> list[_Common]:
    """Return the pairs of each database that both runs compared, if some of either kind are."""
    earlier = {one.name: one for one in before}
    common = [_in_common(earlier[one.name], one) for one in now if one.name in earlier]
    return [one for one in common if one.now.genuine.any() and not one.now.genuine.all()]


def _in_common(before: ScoresSet, now: ScoresSet) -> _Common:
    """Find the pairs of one database that both runs compared, whichever print came first."""
    number = {name: k for k, name in enumerate(now.prints)}
    renumbered = np.array([number.get(name, -1) for name in before.prints], np.intp)
    sides = renumbered[before.probe], renumbered[before.reference]
    earlier = np.flatnonzero((sides[0] >= 0) & (sides[1] >= 0))
    size = len(now.prints)
    _, at_before, at_now = np.intersect1d(
        _keys(sides[0][earlier], sides[1][earlier], size),
        _keys(now.probe, now.reference, size),
        return_indices=True,
    )
    t = now.trials
    both = t.probe[at_now], t.reference[at_now]
    if t.fingers:  # those of the common pairs alone are drawn
        fingers, flat = np.unique(np.concatenate(both), return_inverse=True)
        both = flat[: at_now.size], flat[at_now.size :]
    trials = Trials(t.similarity[at_now], *both, fingers.size if t.fingers else 0)
    similarity = before.trials.similarity[earlier[at_before]]
    names = [(now.prints[now.probe[k]], now.prints[now.reference[k]]) for k in at_now.tolist()]
    return _Common(now.name, replace(trials, similarity=similarity), trials, names)


def _keys(probe: NDArray[np.intp], reference: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    return np.asarray(np.minimum(probe, reference) * size + np.maximum(probe, reference))


def _pooled(
    common: Sequence[_Common],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return similarities before and now, and which pairs are genuine, of all databases."""
    return (
        np.concatenate([c.before.similarity for c in common]),
        np.concatenate([c.now.similarity for c in common]),
        np.concatenate([c.now.genuine for c in common]),
    )


def _compare(
    name: str, common: Sequence[_Common], draws: NDArray[np.float64] | None
) -> SetComparison:
    """Compare the rates; `draws` are bootstrapped differences, None with too few fingers."""
    before, now, genuine = _pooled(common)
    was, is_now = (error_rates(s[genuine], s[~genuine]) for s in (before, now))
    differences = [
        RateDifference.of(
            rate,
            getattr(was, rate),
            getattr(is_now, rate),
            None if draws is None else draws[:, column],
        )
        for column, rate in enumerate(BOOTSTRAPPED)
        if getattr(is_now, rate) is not None
    ]
    return SetComparison(name, int(genuine.size), tuple(differences))


def _mean(sets: Sequence[SetComparison], draws: NDArray[np.float64] | None) -> SetComparison:
    """Return the mean of each rate that all databases have; `draws` as for `_compare`."""
    differences = []
    for column, rate in enumerate(BOOTSTRAPPED):
        of_sets = [d for one in sets for d in one.differences if d.rate == rate]
        if len(of_sets) == len(sets):
            before, now = ([getattr(d, when) for d in of_sets] for when in ("before", "now"))
            drawn = None if draws is None else draws[:, column]
            differences.append(
                RateDifference.of(rate, float(np.mean(before)), float(np.mean(now)), drawn)
            )
    return SetComparison("mean", sum(one.pairs for one in sets), tuple(differences))


def _decisions(common: Sequence[_Common]) -> DecisionChange | None:
    from scipy.stats import binomtest  # noqa: PLC0415  (imports for half a second)

    before, now, genuine = _pooled(common)
    for fmr in DECISION_FMRS:
        at_before, at_now = (threshold_at_fmr(s[~genuine], fmr) for s in (before, now))
        if at_before is not None and at_now is not None:
            break
    else:
        return None
    names = [(c.name, *pair) for c in common for pair in c.pairs]
    was, accepted = (before > at_before) & genuine, (now > at_now) & genuine
    gained, lost = (
        tuple(
            dict(zip(("set", "probe", "reference"), names[k], strict=True))
            for k in np.flatnonzero(changed).tolist()
        )
        for changed in (accepted & ~was, was & ~accepted)
    )
    number = len(gained) + len(lost)
    p_value = float(binomtest(len(lost), number).pvalue) if number else 1.0
    return DecisionChange(p_value, fmr, int(genuine.sum()), gained, lost)
