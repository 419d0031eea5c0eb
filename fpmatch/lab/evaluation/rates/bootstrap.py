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

from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.random import default_rng

from fpmatch.lab.evaluation.rates.error_rates import FMR_LIMITS, ROUNDING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores_set import Trials

    Counts = NDArray[np.int64]

BOOTSTRAPPED: Final = ("eer", *FMR_LIMITS)
"""The rates that are bootstrapped; those that depend on one extreme score cannot be."""
DEFAULT_BOOTSTRAP: Final = 1000
_WEIGHTS_AT_A_TIME: Final = 1_000_000


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


def draw_fingers(fingers: int, bootstrap: int, seed: int, set_index: int = 0) -> Counts:
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
    prints can be compared draw by draw. Where the fingers of a database are not known, its single
    comparisons are drawn.
    """
    sets = np.empty((len(trials), bootstrap, 1 + len(limits)))
    pooled = np.empty((bootstrap, 1 + len(limits)))
    draws = [_draws(one, bootstrap, seed, k) for k, one in enumerate(trials)]
    ranked = [RankedScores.of([one]) for one in trials]
    together = RankedScores.of(trials)
    step = max(1, _WEIGHTS_AT_A_TIME // max(1, sum(one.similarity.size for one in trials)))
    for start in range(0, bootstrap, step):
        rows = slice(start, min(start + step, bootstrap))
        counts = [np.stack(list(islice(one, rows.stop - start))) for one in draws]
        for k, drawn in enumerate(counts):
            sets[k, rows] = ranked[k].rates(drawn, limits)
        if len(trials) == 1:
            pooled[rows] = sets[0, rows]
        else:
            pooled[rows] = together.rates(np.concatenate(counts, axis=1), limits)
    return Replicates(sets, pooled)


def bootstrap_fmr(
    trials: Sequence[Trials], threshold: float, bootstrap: int, seed: int
) -> NDArray[np.float64]:
    """Return the FMR at a threshold for draws of fingers, databases pooled; NaN if undefined."""
    matches, total = np.zeros(bootstrap), np.zeros(bootstrap)
    for k, t in enumerate(trials):
        probe, reference = t.probe[~t.genuine], t.reference[~t.genuine]
        reached = t.similarity[~t.genuine] >= threshold
        for n, counts in enumerate(draw_fingers(t.fingers, bootstrap, seed, k)):
            weights = counts[probe] * counts[reference]
            matches[n] += weights @ reached
            total[n] += weights.sum()
    with np.errstate(invalid="ignore"):
        return np.asarray(matches / total)


def _draws(trials: Trials, bootstrap: int, seed: int, set_index: int) -> Iterator[Counts]:
    """Yield how often each finger, or where they are not known each comparison, is drawn."""
    if trials.fingers:
        yield from draw_fingers(trials.fingers, bootstrap, seed, set_index)
        return
    random = default_rng([seed, set_index])
    kinds = np.flatnonzero(trials.genuine), np.flatnonzero(~trials.genuine)
    for _ in range(bootstrap):
        counts = np.zeros(trials.genuine.size, np.int64)
        for kind in kinds:
            if kind.size:
                drawn = random.integers(kind.size, size=kind.size)
                counts[kind] = np.bincount(drawn, minlength=kind.size)
        yield counts


@dataclass(frozen=True, slots=True, eq=False)
class RankedScores:
    """The order of scores, so that the rates of a draw need only the weights of the pairs.

    A pair counts as often as its `first` unit was drawn times its `second` one, -1 for none; units
    are the fingers, else comparisons, of one database after the other. Pairs are in increasing
    order of score, `genuine` ones first. A threshold is every distinct score, then infinity:
    `genuine_below` and `impostor_below` count the scores below each. For each impostor score,
    `genuine_up_to` counts the genuine scores that are at most as high.
    """

    first: NDArray[np.intp]
    second: NDArray[np.intp]
    genuine: int
    genuine_below: NDArray[np.intp]
    impostor_below: NDArray[np.intp]
    genuine_up_to: NDArray[np.intp]

    @classmethod
    def of(cls, trials: Sequence[Trials]) -> RankedScores:
        """Rank the scores of some databases together."""
        first, second, units = [], [], 0
        for one in trials:
            if one.fingers:
                first.append(one.probe + units)
                second.append(np.where(one.genuine, -1, one.reference + units))
            else:
                first.append(np.arange(one.genuine.size) + units)
                second.append(np.full(one.genuine.size, -1))
            units += one.fingers or one.genuine.size
        similarity = np.concatenate([one.similarity for one in trials])
        genuine = np.concatenate([one.genuine for one in trials])
        order = np.lexsort((similarity, ~genuine))
        count = int(genuine.sum())
        ours, theirs = np.split(similarity[order], [count])
        threshold = np.append(np.unique(similarity), np.inf)
        return cls(
            np.concatenate(first)[order],
            np.concatenate(second)[order],
            count,
            np.searchsorted(ours, threshold, side="left"),
            np.searchsorted(theirs, threshold, side="left"),
            np.searchsorted(ours, theirs, side="right"),
        )

    def rates(self, counts: Counts, limits: Sequence[float]) -> NDArray[np.float64]:
        """Return the EER and the FNMR at the FMRs of `limits` for draws; NaN without both kinds.

        `counts` (draws, units) is how often each unit was drawn.
        """
        once = np.ones((len(counts), 1), np.int32)
        drawn = np.concatenate([counts.astype(np.int32), once], axis=1)
        weights = np.take(drawn, self.first, axis=1)
        weights[:, self.genuine :] *= np.take(drawn, self.second[self.genuine :], axis=1)
        below_g, below_i = map(_cumulated, np.split(weights, [self.genuine], axis=1))
        rates = np.full((len(counts), 1 + len(limits)), np.nan)
        usable = (below_g[:, -1] > 0) & (below_i[:, -1] > 0)
        if not usable.any():
            return rates
        below_g, below_i = below_g[usable], below_i[usable]
        total_g, total_i, rows = below_g[:, -1], below_i[:, -1], np.arange(usable.sum())

        def fmr(t: NDArray[np.intp]) -> NDArray[np.float64]:
            return np.asarray((total_i - below_i[rows, self.impostor_below[t]]) / total_i)

        def fnmr(t: NDArray[np.intp]) -> NDArray[np.float64]:
            return np.asarray(below_g[rows, self.genuine_below[t]] / total_g)

        after = _first(lambda t: fmr(t) <= fnmr(t), self.genuine_below.size - 1, rows.size)
        fall, rise = fmr(after - 1) - fnmr(after - 1), fnmr(after) - fmr(after)
        way = fall / (fall + rise)
        rates[usable, 0] = fmr(after - 1) + way * (fmr(after) - fmr(after - 1))
        for column, limit in enumerate(limits, start=1):
            needed = total_i - np.floor(limit * total_i + ROUNDING)

            def reaches(k: NDArray[np.intp], needed: NDArray[Any] = needed) -> NDArray[np.bool_]:
                return np.asarray(below_i[rows, k] >= needed)

            kept = _first(reaches, self.genuine_up_to.size, rows.size)
            rates[usable, column] = below_g[rows, self.genuine_up_to[kept - 1]] / total_g
        return rates


def _cumulated(weights: NDArray[np.int32]) -> Counts:
    """Return the weights of the first 0, 1, 2, … pairs in each draw."""
    sums = np.zeros((len(weights), weights.shape[1] + 1), np.int64)
    np.cumsum(weights, axis=1, out=sums[:, 1:])
    return sums


def _first(
    holds: Callable[[NDArray[np.intp]], NDArray[np.bool_]], last: int, rows: int
) -> NDArray[np.intp]:
    """Return for each row the first index of 1..last at which `holds`; at `last` it does."""
    low, high = np.zeros(rows, np.intp), np.full(rows, last, np.intp)
    while (high - low > 1).any():
        middle = np.maximum((low + high) // 2, 1)
        reached = holds(middle)
        high = np.where(reached, middle, high)
        low = np.where(reached, low, middle)
    return high
