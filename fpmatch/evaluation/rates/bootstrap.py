"""Bootstrap of error rates over fingers: how rates scatter with other fingers.

The comparisons of a database are not independent: a poor finger affects all its pairs. Fingers are
therefore drawn with replacement, as many as there are, never single comparisons. A finger drawn w
times counts w times in each of its genuine pairs; a pair of fingers drawn v and w times counts v·w
times as an impostor pair. A finger is never an impostor to a copy of itself. Where the fingers are
not known, as in scores without names, single comparisons are drawn; rates then scatter too little.

References
----------
Snijders, Borgatti, "Non-parametric standard errors and tests for network statistics", Connections
22 (1999), for the bootstrap of what is measured between pairs. Bolle, Ratha, Pankanti, "Error
analysis of pattern recognition systems: the subsets bootstrap", CVIU 93 (2004), for fingers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.random import default_rng

from fpmatch.evaluation.rates.error_rates import FMR_LIMITS, error_rates
from fpmatch.evaluation.rates.ranked_trials import RankedTrials
from fpmatch.evaluation.rates.scores_set import Trials

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.random import Generator
    from numpy.typing import NDArray


BOOTSTRAPPED: Final = ("eer", *FMR_LIMITS)
"""The rates that are bootstrapped; those that depend on one extreme score cannot be."""
DEFAULT_BOOTSTRAP: Final = 1000

_WEIGHTS_AT_A_TIME: Final = 2_000_000
_DENSE_FINGERS: Final = 2000  # of a database, whose pairs of fingers fit a dense matrix
# Impostors are first ranked down to the score where FMR is 0.05 plus twice the EER.
_EERS_KEPT: Final = 2
_SHARE_KEPT: Final = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Replicates:
    """The rates of every draw of fingers; NaN where a draw left no pairs of a kind.

    `sets` has shape (databases, draws, rates): the EER, then the FNMR at some FMRs; `pooled` has
    shape (draws, rates), of all databases' scores under one threshold.
    """

    sets: NDArray[np.float64]
    pooled: NDArray[np.float64]

    @property
    def mean(self) -> NDArray[np.float64]:
        """The mean over the databases, of shape (draws, rates)."""
        return np.asarray(self.sets.mean(axis=0))


def draw_fingers(fingers: int, bootstrap: int, seed: int, set_index: int = 0) -> NDArray[np.int64]:
    """Return how often each finger was drawn in each of `bootstrap` draws of all fingers.

    The array has the shape (bootstrap, fingers). Each database has its own draws.
    """
    chances = np.full(fingers, 1 / fingers)
    return default_rng([seed, set_index]).multinomial(fingers, chances, size=bootstrap)


def bootstrap_rates(
    trials: Sequence[Trials],
    bootstrap: int,
    seed: int,
    limits: Sequence[float] = tuple(FMR_LIMITS.values()),
) -> Replicates:
    """Compute the EER, and the FNMR at each FMR of `limits`, for draws of each database's fingers.

    The same seed draws the same fingers, whatever the similarities, so that two runs over the same
    prints can be compared draw by draw. Where the fingers of a database are not known, the single
    comparisons of all are drawn.
    """
    result = Replicates(
        sets=np.empty((len(trials), bootstrap, 1 + len(limits))),
        pooled=np.empty((bootstrap, 1 + len(limits))),
    )
    together = _together(trials)
    if not all(t.fingers for t in trials):
        for k, t in enumerate(trials):
            result.sets[k] = _draw_comparisons(t, bootstrap, [seed, k], limits)
        result.pooled[:] = (
            result.sets[0]
            if len(trials) == 1
            else _draw_comparisons(together, bootstrap, [seed, len(trials)], limits)
        )
        return result
    counts = [draw_fingers(t.fingers, bootstrap, seed, k) for k, t in enumerate(trials)]
    lowest = [_lowest_needed(t, limits) for t in (*trials, together)]
    left = _replicate(trials, counts, lowest, np.arange(bootstrap), limits, result)
    everything = [-np.inf] * len(lowest)
    _replicate(trials, counts, everything, left, limits, result)
    return result


def _together(trials: Sequence[Trials]) -> Trials:
    """Return the comparisons of all databases as one, with consecutive finger numbers."""
    first = np.cumsum([0, *(t.fingers for t in trials)])
    numbered = list(zip(trials, first[:-1], strict=True))
    return Trials(
        similarity=np.concatenate([t.similarity for t in trials]),
        probe=np.concatenate([t.probe + n for t, n in numbered]),
        reference=np.concatenate([t.reference + n for t, n in numbered]),
        fingers=int(first[-1]),
    )


def _lowest_needed(trials: Trials, limits: Sequence[float]) -> float:
    """Return a similarity below which the thresholds of few draws lie."""
    genuine = trials.genuine
    impostor = trials.similarity[~genuine]
    eer = error_rates(trials.similarity[genuine], impostor).eer
    least = max([_SHARE_KEPT, *(2 * limit for limit in limits)])
    share = 1.0 if eer is None else least + _EERS_KEPT * eer
    return float(np.quantile(impostor, 1.0 - share)) if share < 1.0 else -math.inf


def _replicate(
    trials: Sequence[Trials],
    counts: Sequence[NDArray[np.int64]],
    lowest: Sequence[float],
    draws: NDArray[np.intp],
    limits: Sequence[float],
    result: Replicates,
) -> NDArray[np.intp]:
    """Fill in the rates of draws from scores above `lowest`; return draws that need lower ones."""
    kept = zip((*trials, _together(trials)), lowest, strict=True)
    *ranked, together = (RankedTrials.of(t, low) for t, low in kept)
    between = [_impostors_between(t) for t in trials]
    complete = np.ones(draws.size, bool)
    for part in _slices(draws.size, together.genuine.size + together.impostor.size):
        rows = draws[part]
        drawn = [c[rows] for c in counts]
        totals = [_impostor_weight(b, c) for b, c in zip(between, drawn, strict=True)]
        for k, total in enumerate(totals):
            weights = ranked[k].finger_weights(drawn[k])
            result.sets[k, rows], known = ranked[k].rates(weights, total, limits)
            complete[part] &= known
        if len(trials) == 1:
            result.pooled[rows] = result.sets[0, rows]
            continue
        of_all, total = np.concatenate(drawn, axis=1), np.sum(totals, axis=0)
        weights = together.finger_weights(of_all)
        result.pooled[rows], known = together.rates(weights, total, limits)
        complete[part] &= known
    return draws[~complete]


def _draw_comparisons(
    trials: Trials, bootstrap: int, seed: list[int], limits: Sequence[float]
) -> NDArray[np.float64]:
    """Return the rates of draws of as many genuine, and as many impostor, comparisons as there are.

    Of the impostors below all thresholds only the number drawn matters.
    """
    impostors = int((~trials.genuine).sum())
    for lowest in (_lowest_needed(trials, limits), -math.inf):
        ranked, random = RankedTrials.of(trials, lowest), default_rng(seed)
        rates = np.empty((bootstrap, 1 + len(limits)))
        complete = np.ones(bootstrap, bool)
        for rows in _slices(bootstrap, ranked.genuine.size + ranked.impostor.size):
            size = rows.stop - rows.start
            weights = (
                _draw(random, ranked.genuine.size, ranked.genuine.size, size),
                _draw(random, impostors, ranked.impostor.size, size),
            )
            rates[rows], complete[rows] = ranked.rates(weights, np.full(size, impostors), limits)
        if complete.all():
            break
    return rates


def _draw(random: Generator, total: int, ranked: int, size: int) -> NDArray[np.int64]:
    """Return how often each of the `ranked` of `total` comparisons is drawn, (size, ranked)."""
    if not total:
        return np.zeros((size, 0), np.int64)
    chances = np.append(np.full(ranked, 1 / total), max(0.0, 1 - ranked / total))
    return random.multinomial(total, chances / chances.sum(), size=size)[:, :ranked]


def _impostors_between(trials: Trials) -> Any:
    """Return the number of impostor pairs of each two fingers, (fingers, fingers), maybe sparse."""
    impostor = ~trials.genuine
    if trials.fingers > _DENSE_FINGERS:
        from scipy.sparse import coo_array  # noqa: PLC0415

        places = trials.probe[impostor], trials.reference[impostor]
        ones = np.ones(places[0].size)
        return coo_array((ones, places), shape=(trials.fingers, trials.fingers)).tocsr()
    flat = trials.probe[impostor] * trials.fingers + trials.reference[impostor]
    counted = np.bincount(flat, minlength=trials.fingers**2).astype(np.float64)
    return counted.reshape(trials.fingers, trials.fingers)


def _impostor_weight(between: Any, counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the weight of all impostor pairs in each draw."""
    drawn = counts.astype(np.float64)
    return np.asarray(np.einsum("bi,bi->b", drawn @ between, drawn), np.int64)


def bootstrap_fmr(
    trials: Sequence[Trials], threshold: float, bootstrap: int, seed: int
) -> NDArray[np.float64]:
    """Return the FMR at a threshold for draws of fingers, databases pooled; NaN if undefined."""
    matches, total = np.zeros(bootstrap), np.zeros(bootstrap)
    for k, t in enumerate(trials):
        counts = draw_fingers(t.fingers, bootstrap, seed, k)
        impostor = ~t.genuine
        reached = (t.similarity >= threshold) & impostor
        for rows in _slices(bootstrap, t.similarity.size):
            weights = np.take(counts[rows], t.probe, axis=1)
            weights *= np.take(counts[rows], t.reference, axis=1)
            matches[rows] += weights @ reached
            total[rows] += weights @ impostor
    with np.errstate(invalid="ignore"):
        return np.asarray(matches / total)


def _slices(bootstrap: int, pairs: int) -> Iterator[slice]:
    step = max(1, _WEIGHTS_AT_A_TIME // max(pairs, 1))
    return (slice(start, min(start + step, bootstrap)) for start in range(0, bootstrap, step))
