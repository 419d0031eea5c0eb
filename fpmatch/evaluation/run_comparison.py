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
from fpmatch.evaluation.bootstrap import BOOTSTRAPPED, DEFAULT_BOOTSTRAP, Trials, bootstrap_rates
from fpmatch.evaluation.intervals import MIN_FINGERS, Interval, interval_of
from fpmatch.evaluation.rates import FMR_LIMITS, Rates, error_rates, threshold_at_fmr

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.scores import ScoresSet

DECISION_LIMITS: Final = ("fmr1000", "fmr100")
"""Decisions are compared at the first of these that the pairs allow."""


@dataclass(frozen=True, slots=True)
class RateDifference:
    """Hold a rate before and now, over the pairs that both runs compared.

    `interval` is the 95 % interval of ``now - before``; None where there are too few fingers.
    """

    rate: str
    before: float
    now: float
    interval: Interval | None

    @property
    def verdict(self) -> str:
        """Whether the rate got better or worse."""
        if self.now == self.before and self.interval == Interval(0.0, 0.0):
            return "no change"
        if self.interval is None:
            return "too few fingers to tell"
        if not self.interval.excludes_zero:
            return "within chance"
        return "better" if self.now < self.before else "worse"


@dataclass(frozen=True, slots=True)
class ChangedPair:
    """Name a genuine pair that one run accepts and the other does not: database and two images."""

    set: str
    probe: str
    reference: str


@dataclass(frozen=True, slots=True)
class DecisionChange:
    """Hold how decisions on genuine pairs changed, all databases under one threshold.

    Either run has its threshold at the false match rate `fmr`. `gained` and `lost` are the pairs
    that only the later, and only the earlier run accepts. `p_value` is that of McNemar's exact
    test: the probability of a split as uneven if neither run is better.
    """

    fmr: float
    genuine: int
    gained: tuple[ChangedPair, ...]
    lost: tuple[ChangedPair, ...]
    p_value: float


@dataclass(frozen=True, slots=True)
class SetComparison:
    """Hold the comparison of two runs over one database, or over all: pairs and rates."""

    name: str
    pairs: int
    differences: tuple[RateDifference, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the comparison as JSON values."""
        rates = {
            d.rate: {
                "before": d.before,
                "now": d.now,
                "change_interval": d.interval and [d.interval.low, d.interval.high],
                "verdict": d.verdict,
            }
            for d in self.differences
        }
        return {"name": self.name, "pairs": self.pairs, **rates}


@dataclass(frozen=True, slots=True)
class RunComparison:
    """Hold the comparison of the runs of two matchers.

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
        if self.before in {"", self.now}:
            return "before", "now"
        return self.before, self.now

    def as_json(self) -> dict[str, Any]:
        """Return the comparison as JSON values; rates as fractions."""
        d = self.decisions
        return {
            "before": self.before,
            "now": self.now,
            "only_before": self.only_before,
            "only_now": self.only_now,
            "identical": self.identical,
            "sets": [one.as_json() for one in self.sets],
            "mean": self.mean.as_json(),
            "pooled": self.pooled.as_json(),
            "decisions": d
            and {
                "fmr": d.fmr,
                "genuine": d.genuine,
                "gained": [asdict(pair) for pair in d.gained],
                "lost": [asdict(pair) for pair in d.lost],
                "mcnemar_p": d.p_value,
            },
        }


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
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
) -> RunComparison:
    """Compare two runs over the same prints, on the pairs that both have, identified by names.

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
    rates_before = bootstrap_rates([c.trials_before for c in common], bootstrap, seed)
    rates_now = bootstrap_rates([c.trials_now for c in common], bootstrap, seed)
    enough = [c.trials_now.fingers >= MIN_FINGERS for c in common]
    sets = tuple(
        _set_comparison(c.now.name, [c], rates_now.sets[k] - rates_before.sets[k], enough[k])
        for k, c in enumerate(common)
    )
    shared = sum(one.pairs for one in sets)
    similarity_before, similarity_now, _ = _pooled(common)
    return RunComparison(
        before=before[0].matcher,
        now=now[0].matcher,
        only_before=sum(one.probe.size for one in before) - shared,
        only_now=sum(one.probe.size for one in now) - shared,
        identical=int(np.count_nonzero(similarity_now == similarity_before)),
        sets=sets,
        mean=_mean(sets, rates_now.mean - rates_before.mean, all(enough)),
        pooled=_set_comparison(
            "pooled", common, rates_now.pooled - rates_before.pooled, all(enough)
        ),
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
    _, at_before, at_now = np.intersect1d(
        keys, _keys(now.probe, now.reference, size), assume_unique=True, return_indices=True
    )
    fingers, flat = np.unique(
        np.concatenate([now.trials.probe[at_now], now.trials.reference[at_now]]),
        return_inverse=True,
    )
    trials = Trials(
        similarity=now.trials.similarity[at_now],
        probe=flat[: at_now.size],
        reference=flat[at_now.size :],
        fingers=int(fingers.size),
    )
    trials_before = replace(trials, similarity=before.trials.similarity[earlier[at_before]])
    return _Common(now, at_now, trials_before, trials)


def _keys(probe: NDArray[np.intp], reference: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    keys: NDArray[np.intp] = np.minimum(probe, reference) * size + np.maximum(probe, reference)
    return keys


def _pooled(
    common: Sequence[_Common],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return similarities before and now, and which pairs are genuine, of all databases."""
    return (
        np.concatenate([c.trials_before.similarity for c in common]),
        np.concatenate([c.trials_now.similarity for c in common]),
        np.concatenate([c.trials_now.genuine for c in common]),
    )


def _set_comparison(
    name: str, common: Sequence[_Common], draws: NDArray[np.float64], enough: bool
) -> SetComparison:
    before, now, genuine = _pooled(common)
    rates = [error_rates(similarity[genuine], similarity[~genuine]) for similarity in (before, now)]
    return SetComparison(name, int(genuine.size), _differences(*rates, draws=draws, enough=enough))


def _differences(
    before: Rates, now: Rates, *, draws: NDArray[np.float64], enough: bool
) -> tuple[RateDifference, ...]:
    return tuple(
        RateDifference(
            rate=rate,
            before=getattr(before, rate),
            now=getattr(now, rate),
            interval=interval_of(draws[:, column]) if enough else None,
        )
        for column, rate in enumerate(BOOTSTRAPPED)
        if getattr(now, rate) is not None
    )


def _mean(sets: Sequence[SetComparison], draws: NDArray[np.float64], enough: bool) -> SetComparison:
    differences = []
    for column, rate in enumerate(BOOTSTRAPPED):
        found = [d for one in sets for d in one.differences if d.rate == rate]
        if len(found) == len(sets):
            differences.append(
                RateDifference(
                    rate=rate,
                    before=float(np.mean([d.before for d in found])),
                    now=float(np.mean([d.now for d in found])),
                    interval=interval_of(draws[:, column]) if enough else None,
                )
            )
    return SetComparison("mean", sum(one.pairs for one in sets), tuple(differences))


def _decisions(common: Sequence[_Common]) -> DecisionChange | None:
    from scipy.stats import binomtest  # noqa: PLC0415

    before, now, genuine = _pooled(common)
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
    """Name the pair at a row of the pairs of all databases."""
    for c in common:
        if row < c.rows.size:
            k, prints = c.rows[row], c.now.prints
            return ChangedPair(c.now.name, prints[c.now.probe[k]], prints[c.now.reference[k]])
        row -= c.rows.size
    raise IndexError(row)
