"""Bootstrap of error rates over fingers: how rates scatter with other fingers.

The comparisons of a database are not independent: a poor finger affects all its pairs. Fingers are
therefore drawn with replacement, as many as there are, never single comparisons. A finger drawn w
times counts w times in each of its genuine pairs; a pair of fingers drawn v and w times counts v·w
times as an impostor pair. A finger is never an impostor to a copy of itself.

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

from fpmatch.evaluation.rates import FMR_LIMITS, ROUNDING, error_rates

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    Weights = NDArray[np.integer[Any]]


BOOTSTRAPPED: Final = ("eer", *FMR_LIMITS)
"""The rates that are bootstrapped; those that depend on one extreme score cannot be."""
DEFAULT_BOOTSTRAP: Final = 1000

_WEIGHTS_AT_A_TIME: Final = 2_000_000
# Impostors are first ranked down to the score where FMR is 0.05 plus twice the EER.
_EERS_KEPT: Final = 2
_SHARE_KEPT: Final = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """Hold the comparisons of one database: similarity and the two fingers, numbered from 0."""

    similarity: NDArray[np.float64]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    fingers: int

    @property
    def genuine(self) -> NDArray[np.bool_]:
        """Whether both prints show the same finger."""
        return np.asarray(self.probe == self.reference)


@dataclass(frozen=True, slots=True, eq=False)
class Replicates:
    """Hold the rates of every draw of fingers; NaN where a draw left no pairs of a kind.

    `sets` has shape (databases, draws, rates), with the rates of `BOOTSTRAPPED`; `pooled` has shape
    (draws, rates), of all databases' scores under one threshold.
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


def bootstrap_rates(trials: Sequence[Trials], bootstrap: int, seed: int) -> Replicates:
    """Compute the rates of `BOOTSTRAPPED` for draws of each database's fingers.

    The same seed draws the same fingers, whatever the similarities, so that two runs over the same
    prints can be compared draw by draw.
    """
    counts = [draw_fingers(t.fingers, bootstrap, seed, k) for k, t in enumerate(trials)]
    result = Replicates(
        sets=np.empty((len(trials), bootstrap, len(BOOTSTRAPPED))),
        pooled=np.empty((bootstrap, len(BOOTSTRAPPED))),
    )
    together = _together(trials)
    lowest = [_lowest_needed(t) for t in (*trials, together)]
    left = _replicate(trials, counts, lowest, np.arange(bootstrap), result)
    everything = [-np.inf] * len(lowest)
    _replicate(trials, counts, everything, left, result)
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


def _lowest_needed(trials: Trials) -> float:
    """Return a similarity below which the thresholds of few draws lie."""
    genuine = trials.genuine
    impostor = trials.similarity[~genuine]
    eer = error_rates(trials.similarity[genuine], impostor).eer
    share = 1.0 if eer is None else _SHARE_KEPT + _EERS_KEPT * eer
    return float(np.quantile(impostor, 1.0 - share)) if share < 1.0 else -math.inf


def _replicate(
    trials: Sequence[Trials],
    counts: Sequence[NDArray[np.int64]],
    lowest: Sequence[float],
    draws: NDArray[np.intp],
    result: Replicates,
) -> NDArray[np.intp]:
    """Fill in the rates of draws from scores above `lowest`; return draws that need lower ones."""
    kept = zip((*trials, _together(trials)), lowest, strict=True)
    *ranked, together = (_RankedTrials.of(t, low) for t, low in kept)
    between = [_impostors_between(t) for t in trials]
    complete = np.ones(draws.size, bool)
    for part in _slices(draws.size, together.genuine.size + together.impostor.size):
        rows = draws[part]
        drawn = [c[rows] for c in counts]
        totals = [_impostor_weight(b, c) for b, c in zip(between, drawn, strict=True)]
        for k, total in enumerate(totals):
            result.sets[k, rows], known = ranked[k].rates(drawn[k], total)
            complete[part] &= known
        if len(trials) == 1:
            result.pooled[rows] = result.sets[0, rows]
            continue
        of_all, total = np.concatenate(drawn, axis=1), np.sum(totals, axis=0)
        result.pooled[rows], known = together.rates(of_all, total)
        complete[part] &= known
    return draws[~complete]


@dataclass(frozen=True, slots=True, eq=False)
class _RankedTrials:
    """Hold the order of scores, so that rates of draws need only the weights of the pairs.

    Impostors below a lowest score may be left out; of them only the total weight must be known.
    Pairs are indices by increasing score. A threshold is every distinct score from the lowest on,
    then infinity: `genuine_below` and `impostor_below` count the scores below each. For each
    impostor score, `genuine_up_to` counts the genuine scores that are at most as high.
    """

    trials: Trials
    genuine: NDArray[np.intp]
    impostor: NDArray[np.intp]
    genuine_below: NDArray[np.intp]
    impostor_below: NDArray[np.intp]
    genuine_up_to: NDArray[np.intp]

    @classmethod
    def of(cls, trials: Trials, lowest: float) -> _RankedTrials:
        """Rank scores; impostors below `lowest` are left out."""
        similarity, kept = trials.similarity, trials.similarity >= lowest
        pairs = np.flatnonzero(trials.genuine), np.flatnonzero(~trials.genuine & kept)
        ours, theirs = (k[np.argsort(similarity[k], kind="stable")] for k in pairs)
        threshold = np.append(np.unique(similarity[kept]), np.inf)
        return cls(
            trials=trials,
            genuine=ours,
            impostor=theirs,
            genuine_below=np.searchsorted(similarity[ours], threshold, side="left"),
            impostor_below=np.searchsorted(similarity[theirs], threshold, side="left"),
            genuine_up_to=np.searchsorted(similarity[ours], similarity[theirs], side="right"),
        )

    def rates(
        self, counts: NDArray[np.int64], total_i: NDArray[np.int64]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the rates of draws, and whether the ranked scores determine them.

        `counts` holds how often each finger was drawn, and `total_i` the weight of all impostors,
        those left out included. Rates are NaN where a draw has no pairs of a kind.
        """
        below_g, below_i = self._cumulated_weights(counts)
        total_g, total_ranked = below_g[:, -1], below_i[:, -1]
        rows = np.arange(len(counts))
        rates = np.full((rows.size, len(BOOTSTRAPPED)), np.nan)
        usable = (total_g > 0) & (total_i > 0)
        if not usable.any():
            return rates, np.ones(rows.size, bool)
        if not self.impostor.size:
            return rates, ~usable
        nonzero_g, nonzero_i = np.maximum(total_g, 1), np.maximum(total_i, 1)

        def fmr(t: NDArray[np.intp]) -> NDArray[np.float64]:
            matched = total_ranked - below_i[rows, self.impostor_below[t]]
            return np.asarray(matched / nonzero_i)

        def fnmr(t: NDArray[np.intp]) -> NDArray[np.float64]:
            return np.asarray(below_g[rows, self.genuine_below[t]] / nonzero_g)

        after = _first(lambda t: fmr(t) <= fnmr(t), self.genuine_below.size - 1, rows.size)
        complete = after > 0
        before = np.maximum(after - 1, 0)
        fall, rise = fmr(before) - fnmr(before), fnmr(after) - fmr(after)
        way = fall / np.maximum(fall + rise, np.finfo(np.float64).tiny)
        rates[:, 0] = fmr(before) + way * (fmr(after) - fmr(before))
        for column, limit in enumerate(FMR_LIMITS.values(), start=1):
            needed = total_ranked - np.floor(limit * total_i + ROUNDING)

            def reaches(k: NDArray[np.intp], needed: NDArray[Any] = needed) -> NDArray[np.bool_]:
                return np.asarray(below_i[rows, k] >= needed)

            kept = _first(reaches, self.impostor.size, rows.size)
            complete &= kept > 0
            rejected = self.genuine_up_to[np.maximum(kept - 1, 0)]
            rates[:, column] = below_g[rows, rejected] / nonzero_g
        rates[~usable] = np.nan
        return rates, complete | ~usable

    def _cumulated_weights(self, counts: NDArray[np.int64]) -> tuple[Weights, Weights]:
        """Return the weights of the first 0, 1, 2, … genuine, and impostor, pairs in each draw."""
        t = self.trials
        highest = t.similarity.size * int(counts.max()) ** 2
        drawn = counts.astype(np.int32 if highest <= np.iinfo(np.int32).max else np.int64)
        genuine = np.take(drawn, t.probe[self.genuine], axis=1)
        impostor = np.take(drawn, t.probe[self.impostor], axis=1)
        impostor *= np.take(drawn, t.reference[self.impostor], axis=1)
        return _cumulated(genuine), _cumulated(impostor)


def _cumulated(weights: Weights) -> Weights:
    sums = np.zeros((len(weights), weights.shape[1] + 1), weights.dtype)
    np.cumsum(weights, axis=1, out=sums[:, 1:])
    return sums


def _first(
    holds: Callable[[NDArray[np.intp]], NDArray[np.bool_]], last: int, rows: int
) -> NDArray[np.intp]:
    """Return for each row the first index of 0..last at which `holds`; at `last` it does."""
    low, high = np.full(rows, -1, np.intp), np.full(rows, last, np.intp)
    while (high - low > 1).any():
        middle = np.maximum((low + high) // 2, 0)
        found = holds(middle)
        high = np.where(found, middle, high)
        low = np.where(found, low, middle)
    return high


def _impostors_between(trials: Trials) -> NDArray[np.float64]:
    """Return the number of impostor pairs of each two fingers, shape (fingers, fingers)."""
    impostor = ~trials.genuine
    flat = trials.probe[impostor] * trials.fingers + trials.reference[impostor]
    counted = np.bincount(flat, minlength=trials.fingers**2).astype(np.float64)
    return counted.reshape(trials.fingers, trials.fingers)


def _impostor_weight(between: NDArray[np.float64], counts: NDArray[np.int64]) -> NDArray[np.int64]:
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
