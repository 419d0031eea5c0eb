"""Error rates of resampled fingers: how far rates would scatter had other fingers been taken.

The comparisons of a database are no independent trials: a poor finger spoils all its pairs. So
fingers are drawn, with replacement and as many as there are, never single comparisons. A finger
drawn w times counts w times in each of its genuine pairs, and a pair of fingers drawn v and w times
counts v·w times as an impostor pair; a finger is never an impostor to a copy of itself.

References
----------
Snijders, Borgatti, "Non-parametric standard errors and tests for network statistics", Connections
22 (1999), for the bootstrap of what is measured between pairs. Bolle, Ratha, Pankanti, "Error
analysis of pattern recognition systems: the subsets bootstrap", CVIU 93 (2004), for fingers.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.evaluation.rates import FMR_LIMITS, ROUNDING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

RESAMPLED: Final = ("eer", *FMR_LIMITS)
"""The rates that are resampled; those of a single extreme score cannot be."""

_WEIGHTS_AT_A_TIME: Final = 4_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """Hold the comparisons of one database.

    Parameters
    ----------
    similarity : ndarray of float64, shape (N,)
        What each gave.
    probe, reference : ndarray of intp, shape (N,)
        The two fingers of each, numbered from 0; the same finger for a genuine pair.
    fingers : int
        How many fingers there are.
    """

    similarity: NDArray[np.float64]
    probe: NDArray[np.intp]
    reference: NDArray[np.intp]
    fingers: int

    @property
    def genuine(self) -> NDArray[np.bool_]:
        """Whether both prints show the same finger."""
        same: NDArray[np.bool_] = self.probe == self.reference
        return same


@dataclass(frozen=True, slots=True, eq=False)
class Replicates:
    """Hold the rates of every draw of fingers; NaN where a draw left no pairs of a kind.

    Parameters
    ----------
    sets : ndarray of float64, shape (S, B, R)
        Of each database and draw the rates named in `RESAMPLED`.
    pooled : ndarray of float64, shape (B, R)
        The same of all databases' scores under one threshold.
    """

    sets: NDArray[np.float64]
    pooled: NDArray[np.float64]

    @property
    def mean(self) -> NDArray[np.float64]:
        """The mean over the databases, of shape (B, R)."""
        averaged: NDArray[np.float64] = self.sets.mean(axis=0)
        return averaged


def draw_fingers(fingers: int, resamples: int, seed: int, set_index: int = 0) -> NDArray[np.int64]:
    """Draw as many fingers as there are, again and again.

    Parameters
    ----------
    fingers, resamples : int
        How many to draw from, and how often.
    seed, set_index : int
        Make the draw; each database of an evaluation has its own.

    Returns
    -------
    ndarray of int64, shape (resamples, fingers)
        How often each finger was drawn.

    Examples
    --------
    >>> draw_fingers(4, 2, seed=1).sum(axis=1).tolist()
    [4, 4]
    """
    rng = np.random.default_rng([seed, set_index])
    return rng.multinomial(fingers, np.full(fingers, 1 / fingers), size=resamples)


def resample_rates(trials: Sequence[Trials], resamples: int, seed: int) -> Replicates:
    """Compute the rates of `RESAMPLED` for draws of fingers, each database's own.

    Parameters
    ----------
    trials : sequence of Trials
        The databases.
    resamples, seed : int
        How many draws, and what makes them: the same seed draws the same fingers, whatever the
        similarities, so that two runs over the same prints can be compared draw by draw.

    Returns
    -------
    Replicates
        Their rates.
    """
    counts = [draw_fingers(t.fingers, resamples, seed, k) for k, t in enumerate(trials)]
    genuine = np.concatenate([t.genuine for t in trials])
    pooled = _Ranked.of(np.concatenate([t.similarity for t in trials]), genuine)
    ranked = [_Ranked.of(t.similarity, t.genuine) for t in trials]
    result = Replicates(
        sets=np.empty((len(trials), resamples, len(RESAMPLED))),
        pooled=np.empty((resamples, len(RESAMPLED))),
    )
    for rows in _slices(resamples, genuine.size):
        weights = [_pair_weights(t, c[rows]) for t, c in zip(trials, counts, strict=True)]
        for k, w in enumerate(weights):
            result.sets[k, rows] = ranked[k].rates(w)
        alone = len(weights) == 1
        result.pooled[rows] = (
            result.sets[0, rows] if alone else pooled.rates(np.concatenate(weights, axis=1))
        )
    return result


def resample_fmr(
    trials: Sequence[Trials], threshold: float, resamples: int, seed: int
) -> NDArray[np.float64]:
    """Compute the false match rate at one threshold for draws of fingers, all databases pooled.

    Parameters
    ----------
    trials : sequence of Trials
        The databases.
    threshold : float
        Similarity from which on a comparison is a match.
    resamples, seed : int
        As for `resample_rates`.

    Returns
    -------
    ndarray of float64, shape (resamples,)
        The rates; NaN where a draw left no impostors.
    """
    matches, total = np.zeros(resamples), np.zeros(resamples)
    for k, t in enumerate(trials):
        counts = draw_fingers(t.fingers, resamples, seed, k)
        impostor = ~t.genuine
        reached = (t.similarity >= threshold) & impostor
        for rows in _slices(resamples, t.similarity.size):
            weights = _pair_weights(t, counts[rows])
            matches[rows] += weights @ reached
            total[rows] += weights @ impostor
    with np.errstate(invalid="ignore"):
        rates: NDArray[np.float64] = matches / total
    return rates


def _slices(resamples: int, pairs: int) -> Iterator[slice]:
    step = max(1, _WEIGHTS_AT_A_TIME // max(pairs, 1))
    for start in range(0, resamples, step):
        yield slice(start, min(start + step, resamples))


def _pair_weights(trials: Trials, counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how often each pair counts in each draw, of shape (draws, pairs)."""
    probe = np.take(counts, trials.probe, axis=1)
    other = np.where(trials.genuine, 1, np.take(counts, trials.reference, axis=1))
    return probe * other


@dataclass(frozen=True, slots=True, eq=False)
class _Ranked:
    """Hold the order of some scores, so that rates need only the pairs' weights.

    Parameters
    ----------
    genuine, impostor : ndarray of intp
        Indices of the pairs, by increasing score.
    genuine_below, impostor_below : ndarray of intp, shape (T,)
        How many of them lie below each threshold: every distinct score, then infinity.
    genuine_up_to : ndarray of intp
        How many genuine scores are at most as high as each impostor score.
    """

    genuine: NDArray[np.intp]
    impostor: NDArray[np.intp]
    genuine_below: NDArray[np.intp]
    impostor_below: NDArray[np.intp]
    genuine_up_to: NDArray[np.intp]

    @classmethod
    def of(cls, similarity: NDArray[np.float64], genuine: NDArray[np.bool_]) -> _Ranked:
        ours, theirs = np.flatnonzero(genuine), np.flatnonzero(~genuine)
        ours = ours[np.argsort(similarity[ours], kind="stable")]
        theirs = theirs[np.argsort(similarity[theirs], kind="stable")]
        threshold = np.append(np.unique(similarity), np.inf)
        return cls(
            genuine=ours,
            impostor=theirs,
            genuine_below=np.searchsorted(similarity[ours], threshold, side="left"),
            impostor_below=np.searchsorted(similarity[theirs], threshold, side="left"),
            genuine_up_to=np.searchsorted(similarity[ours], similarity[theirs], side="right"),
        )

    def rates(self, weights: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the rates of `RESAMPLED` of each row of pair weights."""
        below_g, below_i = _cumulated(weights, self.genuine), _cumulated(weights, self.impostor)
        total_g, total_i = below_g[:, -1], below_i[:, -1]
        rows = np.arange(len(weights))
        rates = np.full((len(weights), len(RESAMPLED)), np.nan)
        usable = (total_g > 0) & (total_i > 0)
        if not usable.any():
            return rates
        nonzero_g, nonzero_i = np.maximum(total_g, 1), np.maximum(total_i, 1)

        def fmr(t: NDArray[np.intp]) -> NDArray[np.float64]:
            return (total_i - below_i[rows, self.impostor_below[t]]) / nonzero_i

        def fnmr(t: NDArray[np.intp]) -> NDArray[np.float64]:
            return below_g[rows, self.genuine_below[t]] / nonzero_g

        after = _first(lambda t: fmr(t) <= fnmr(t), self.genuine_below.size - 1, rows.size)
        before = np.maximum(after - 1, 0)
        fall, rise = fmr(before) - fnmr(before), fnmr(after) - fmr(after)
        way = fall / np.maximum(fall + rise, np.finfo(np.float64).tiny)
        rates[:, 0] = fmr(before) + way * (fmr(after) - fmr(before))
        for column, limit in enumerate(FMR_LIMITS.values(), start=1):
            needed = total_i - np.floor(limit * total_i + ROUNDING)
            kept = _first(partial(_reaches, below_i, needed), self.impostor.size, rows.size)
            rejected = self.genuine_up_to[np.maximum(kept - 1, 0)]
            rates[:, column] = below_g[rows, rejected] / nonzero_g
        rates[~usable] = np.nan
        return rates


def _cumulated(weights: NDArray[np.int64], order: NDArray[np.intp]) -> NDArray[np.int64]:
    """Return the weight of the first 0, 1, 2, … pairs of an order, of shape (rows, pairs + 1)."""
    sums = np.zeros((len(weights), order.size + 1), np.int64)
    np.cumsum(np.take(weights, order, axis=1), axis=1, out=sums[:, 1:])
    return sums


def _reaches(
    below: NDArray[np.int64], needed: NDArray[np.float64], k: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Return of each row whether the weight below its k-th impostor is what must be rejected."""
    enough: NDArray[np.bool_] = below[np.arange(k.size), k] >= needed
    return enough


def _first(
    holds: Callable[[NDArray[np.intp]], NDArray[np.bool_]], last: int, rows: int
) -> NDArray[np.intp]:
    """Return for each row the first index of 0..last from which on `holds`; at `last` it does."""
    low, high = np.full(rows, -1, np.intp), np.full(rows, last, np.intp)
    while (high - low > 1).any():
        middle = np.maximum((low + high) // 2, 0)
        found = holds(middle)
        high = np.where(found, middle, high)
        low = np.where(found, low, middle)
    return high
