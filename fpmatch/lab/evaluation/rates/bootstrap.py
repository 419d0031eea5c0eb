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
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.random import default_rng

from fpmatch.lab.evaluation.rates.error_rates import FMR_LIMITS, ROUNDING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.random import Generator
    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores_set import Trials

    Weights = NDArray[np.int64]

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


def draw_fingers(fingers: int, bootstrap: int, seed: int, set_index: int = 0) -> Weights:
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
    ranks = [_Ranks.of([one]) for one in trials]
    together = _Ranks.of(trials)
    draws = zip(*(_pair_weights(t, bootstrap, seed, k) for k, t in enumerate(trials)), strict=True)
    start = 0
    for weights in _batches(draws, together.order.size):
        rows = slice(start, start := start + len(weights[0]))
        for k, of_set in enumerate(weights):
            sets[k, rows] = ranks[k].rates(of_set, limits)
        pooled[rows] = (
            sets[0, rows]
            if len(trials) == 1
            else together.rates(np.concatenate(weights, axis=1), limits)
        )
    return Replicates(sets, pooled)


def bootstrap_fmr(
    trials: Sequence[Trials], threshold: float, bootstrap: int, seed: int
) -> NDArray[np.float64]:
    """Return the FMR at a threshold for draws of fingers, databases pooled; NaN if undefined."""
    matches, total = np.zeros(bootstrap), np.zeros(bootstrap)
    for k, t in enumerate(trials):
        reached = (t.similarity >= threshold) & ~t.genuine
        for n, weights in enumerate(_pair_weights(t, bootstrap, seed, k)):
            matches[n] += weights @ reached
            total[n] += weights @ ~t.genuine
    with np.errstate(invalid="ignore"):
        return np.asarray(matches / total)


def _pair_weights(trials: Trials, bootstrap: int, seed: int, set_index: int) -> Iterator[Weights]:
    """Yield how often each comparison of a database counts in each draw."""
    if trials.fingers:
        genuine = trials.genuine
        for counts in draw_fingers(trials.fingers, bootstrap, seed, set_index):
            of_probe, of_reference = counts[trials.probe], counts[trials.reference]
            yield np.where(genuine, of_probe, of_probe * of_reference)
        return
    random = default_rng([seed, set_index])
    kinds = np.flatnonzero(trials.genuine), np.flatnonzero(~trials.genuine)
    for _ in range(bootstrap):
        weights = np.zeros(trials.genuine.size, np.int64)
        for kind in kinds:
            weights[kind] = _drawn(random, kind.size)
        yield weights


def _drawn(random: Generator, size: int) -> Weights:
    """Return how often each of `size` things is drawn in as many draws with replacement."""
    return np.bincount(random.integers(size, size=size) if size else [], minlength=size)


def _batches(draws: Iterator[tuple[Weights, ...]], pairs: int) -> Iterator[list[NDArray[np.int64]]]:
    """Yield the weights of some draws at a time, an array (draws, pairs) for each database."""
    step = max(1, _WEIGHTS_AT_A_TIME // max(pairs, 1))
    batch: list[tuple[Weights, ...]] = []
    for draw in draws:
        batch.append(draw)
        if len(batch) == step:
            yield [np.stack(of_set) for of_set in zip(*batch, strict=True)]
            batch = []
    if batch:
        yield [np.stack(of_set) for of_set in zip(*batch, strict=True)]


@dataclass(frozen=True, slots=True, eq=False)
class _Ranks:
    """The order of scores, so that the rates of a draw need only the weights of the pairs.

    `order` sorts the pairs by score, `genuine` is in that order, and `last` is the last place of
    each distinct score.
    """

    order: NDArray[np.intp]
    genuine: NDArray[np.bool_]
    last: NDArray[np.intp]

    @classmethod
    def of(cls, trials: Sequence[Trials]) -> _Ranks:
        similarity = np.concatenate([one.similarity for one in trials])
        genuine = np.concatenate([one.genuine for one in trials])
        order = np.argsort(similarity, kind="stable")
        last = np.flatnonzero(np.append(np.diff(similarity[order]) != 0, True))
        return cls(order, genuine[order], last)

    def rates(self, weights: Weights, limits: Sequence[float]) -> NDArray[np.float64]:
        """Return the EER and the FNMR at the FMRs of `limits`, of `weights` (draws, pairs)."""
        rates = np.full((len(weights), 1 + len(limits)), np.nan)
        ordered = weights[:, self.order]
        # Weights at or below each distinct score; a threshold at the next one rejects them.
        genuine = np.cumsum(ordered * self.genuine, axis=1)[:, self.last]
        impostor = np.cumsum(ordered * ~self.genuine, axis=1)[:, self.last]
        total = impostor[:, -1]
        usable = (genuine[:, -1] > 0) & (total > 0)
        if not usable.any():
            return rates
        genuine, impostor, total = genuine[usable], impostor[usable], total[usable]
        rows = np.arange(len(total))
        fnmr = genuine / genuine[:, -1:]
        fmr = (total[:, np.newaxis] - impostor) / total[:, np.newaxis]
        after = np.argmax(fmr <= fnmr, axis=1)
        before = np.maximum(after - 1, 0)  # where `after` is the first, below all scores: 1 and 0
        fmr_before = np.where(after > 0, fmr[rows, before], 1.0)
        fnmr_before = np.where(after > 0, fnmr[rows, before], 0.0)
        fmr_after, fnmr_after = fmr[rows, after], fnmr[rows, after]
        fall, rise = fmr_before - fnmr_before, fnmr_after - fmr_after
        rates[usable, 0] = fmr_before + fall / (fall + rise) * (fmr_after - fmr_before)
        for column, limit in enumerate(limits, start=1):
            rejected = total - np.floor(limit * total + ROUNDING)
            highest = np.argmax(impostor >= rejected[:, np.newaxis], axis=1)
            rates[usable, column] = fnmr[rows, highest]
        return rates
