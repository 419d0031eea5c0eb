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

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.lab.evaluation.rates.bootstrap import (
    BOOTSTRAPPED,
    DEFAULT_BOOTSTRAP,
    MIN_FINGERS,
    bootstrap_rates,
    interval_of,
)
from fpmatch.lab.evaluation.rates.error_rates import (
    FMR_LIMITS,
    error_rates,
    mean_rates,
    threshold_at_fmr,
)
from fpmatch.lab.evaluation.rates.scores import Trials, split

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.error_rates import Rates
    from fpmatch.lab.evaluation.rates.scores import ScoresSet

DECISION_FMRS: Final = (FMR_LIMITS["fmr1000"], FMR_LIMITS["fmr100"])
"""Decisions are those at the first of these that the pairs allow."""


class _Common(NamedTuple):
    """The pairs of a database that both runs compared, in one order: `at` so in the later run."""

    scores: ScoresSet
    at: NDArray[np.intp]
    before: Trials
    now: Trials


def compare_runs(
    before: Sequence[ScoresSet],
    now: Sequence[ScoresSet],
    *,
    bootstrap: int = DEFAULT_BOOTSTRAP,
    seed: int = 0,
) -> dict[str, Any]:
    """Compare two runs over the same prints, on the pairs that both have, identified by names.

    Returns JSON values: the matchers `before` and `now`; `sets`, `mean` and `pooled`, which have
    their number of `pairs` and of each rate its value `before` and `now`, the 95 % interval of the
    change and a verdict; and `decisions`. Pairs that just one run compared are left out;
    `identical` counts those whose similarity is the same in both, to the last bit.
    Raises a `DatasetError` if they have no genuine or no impostor pair in common.
    """
    common = common_pairs(before, now)
    if not common:
        names = "; ".join(", ".join(sorted(one.name for one in run)) for run in (before, now))
        raise DatasetError(f"the two runs have no genuine and impostor pairs in common: {names}")
    earlier, later = [one.before for one in common], [one.now for one in common]
    (sets_before, before_pooled), (sets_now, now_pooled) = (
        bootstrap_rates(run, bootstrap, seed) for run in (earlier, later)
    )
    of_mean = sets_now.mean(axis=0) - sets_before.mean(axis=0)
    changes = [*(sets_now - sets_before), of_mean, now_pooled - before_pooled]
    rates = [[error_rates(*split([run])) for run in (one.before, one.now)] for one in common]
    rates.append([mean_rates(column) for column in zip(*rates, strict=True)])
    rates.append([error_rates(*split(run)) for run in (earlier, later)])
    shared = sum(one.at.size for one in common)
    about = [(one.scores.name, one.at.size, one.now.fingers) for one in common]
    fewest = min(one.fingers for one in later)
    about += [("mean", shared, fewest), ("pooled", shared, fewest)]
    compared = []
    for (name, pairs, fingers), both, draws in zip(about, rates, changes, strict=True):
        enough = bootstrap > 0 and fingers >= MIN_FINGERS
        differences = _differences(both[0], both[1], draws if enough else None)
        compared.append({"name": name, "pairs": pairs, **differences})
    same = [np.count_nonzero(one.before.similarity == one.now.similarity) for one in common]
    return {
        "before": before[0].matcher,
        "now": now[0].matcher,
        "only_before": sum(one.probe.size for one in before) - shared,
        "only_now": sum(one.probe.size for one in now) - shared,
        "identical": int(sum(same)),
        "sets": compared[:-2],
        "mean": compared[-2],
        "pooled": compared[-1],
        "decisions": _decisions(common),
    }


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
    _, at_before, at_now = np.intersect1d(
        _keys(sides[0][earlier], sides[1][earlier], len(number)),
        _keys(now.probe, now.reference, len(number)),
        return_indices=True,
    )
    t = now.trials
    both = t.probe[at_now], t.reference[at_now]
    if t.fingers:  # those of the common pairs alone are drawn
        fingers, flat = np.unique(np.concatenate(both), return_inverse=True)
        both = flat[: at_now.size], flat[at_now.size :]
    trials = Trials(t.similarity[at_now], *both, fingers.size if t.fingers else 0)
    similarity = before.trials.similarity[earlier[at_before]]
    return _Common(now, at_now, replace(trials, similarity=similarity), trials)


def _keys(probe: NDArray[np.intp], reference: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    return np.asarray(np.minimum(probe, reference) * size + np.maximum(probe, reference))


def _differences(
    before: Rates, now: Rates, changes: NDArray[np.float64] | None
) -> dict[str, dict[str, Any]]:
    """Return each rate before and now, the 95 % interval of ``now - before``, and a verdict.

    `changes` are bootstrapped differences, a column a rate; None with too few fingers. There is no
    interval where the rates differ neither as measured nor in any draw, which is "no change".
    """
    differences = {}
    for column, rate in enumerate(BOOTSTRAPPED):
        was, is_now = getattr(before, rate), getattr(now, rate)
        if was is None or is_now is None:
            continue
        draws = None if changes is None else changes[:, column]
        interval = None if draws is None else interval_of(draws)
        if draws is not None and is_now == was and not np.nan_to_num(draws).any():
            interval, verdict = None, "no change"
        elif interval is None:
            verdict = "too few fingers to tell"
        elif interval[0] <= 0 <= interval[1]:
            verdict = "within chance"
        else:
            verdict = "better" if is_now < was else "worse"
        limits = {"change_interval": interval, "verdict": verdict}
        differences[rate] = {"before": was, "now": is_now, **limits}
    return differences


def _decisions(common: Sequence[_Common]) -> dict[str, Any] | None:
    """Return the changed decisions on genuine pairs, all databases under one threshold.

    Either run has its threshold at the false match rate `fmr`. `mcnemar_p` is the p-value of
    McNemar's exact test: the probability of a split as uneven if neither run is better. `gained`
    and `lost` are the pairs that only the later, and only the earlier run accepts. None where there
    are too few pairs for a threshold.
    """
    from scipy.stats import binomtest  # noqa: PLC0415  (imports for half a second)

    before, now, genuine = (
        np.concatenate(columns)
        for columns in zip(
            *((c.before.similarity, c.now.similarity, c.now.genuine) for c in common), strict=True
        )
    )
    for fmr in DECISION_FMRS:
        at_before, at_now = (threshold_at_fmr(s[~genuine], fmr) for s in (before, now))
        if at_before is not None and at_now is not None:
            break
    else:
        return None
    places = [(c.scores, k) for c in common for k in c.at.tolist()]
    was, accepted = (before > at_before) & genuine, (now > at_now) & genuine
    gained, lost = (
        [
            {"set": scores.name, "probe": scores.prints[scores.probe[k]]}
            | {"reference": scores.prints[scores.reference[k]]}
            for scores, k in (places[n] for n in np.flatnonzero(changed).tolist())
        ]
        for changed in (accepted & ~was, was & ~accepted)
    )
    number = len(gained) + len(lost)
    return {
        "mcnemar_p": float(binomtest(len(lost), number).pvalue) if number else 1.0,
        "fmr": fmr,
        "genuine": int(genuine.sum()),
        "gained": gained,
        "lost": lost,
    }
