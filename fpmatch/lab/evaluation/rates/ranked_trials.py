"""Error rates of many draws of the same comparisons, which are ranked once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.lab.evaluation.rates.error_rates import ROUNDING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores_set import Trials

    Weights = NDArray[np.integer[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class RankedTrials:
    """The order of scores, so that rates of draws need only the weights of the pairs.

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
    def of(cls, trials: Trials, lowest: float) -> RankedTrials:
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

    def finger_weights(self, counts: NDArray[np.int64]) -> tuple[Weights, Weights]:
        """Return the weights of genuine and impostor pairs where fingers were drawn `counts` times.

        `counts` has the shape (draws, fingers); the pairs are in increasing order of score.
        """
        t = self.trials
        highest = t.similarity.size * int(counts.max()) ** 2
        drawn = counts.astype(np.int32 if highest <= np.iinfo(np.int32).max else np.int64)
        genuine = np.take(drawn, t.probe[self.genuine], axis=1)
        impostor = np.take(drawn, t.probe[self.impostor], axis=1)
        impostor *= np.take(drawn, t.reference[self.impostor], axis=1)
        return genuine, impostor

    def rates(
        self, weights: tuple[Weights, Weights], total_i: NDArray[np.int64], limits: Sequence[float]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the rates of draws, and whether the ranked scores determine them.

        The rates are the EER and the FNMR at each FMR of `limits`. `weights` are those of genuine
        and impostor pairs, (draws, pairs) each, and `total_i` is the weight of all impostors, those
        left out included. Rates are NaN where a draw has no pairs of a kind.
        """
        below_g, below_i = map(_cumulated, weights)
        total_g, total_ranked = below_g[:, -1], below_i[:, -1]
        rows = np.arange(len(below_g))
        rates = np.full((rows.size, 1 + len(limits)), np.nan)
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
        for column, limit in enumerate(limits, start=1):
            needed = total_ranked - np.floor(limit * total_i + ROUNDING)

            def reaches(k: NDArray[np.intp], needed: NDArray[Any] = needed) -> NDArray[np.bool_]:
                return np.asarray(below_i[rows, k] >= needed)

            kept = _first(reaches, self.impostor.size, rows.size)
            complete &= kept > 0
            rejected = self.genuine_up_to[np.maximum(kept - 1, 0)]
            rates[:, column] = below_g[rows, rejected] / nonzero_g
        rates[~usable] = np.nan
        return rates, complete | ~usable


def _cumulated(weights: Weights) -> Weights:
    """Return the weights of the first 0, 1, 2, … pairs in each draw."""
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
        reached = holds(middle)
        high = np.where(reached, middle, high)
        low = np.where(reached, low, middle)
    return high
