"""Error rates of weighted scores, for many weightings at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.evaluation.rates import FMR_LIMITS, ROUNDING

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class RankedScores:
    """Hold the order of scores, so that rates need only the weights of the pairs.

    Impostors below a lowest score may be left out; of them only the total weight must be known.
    Pairs are indices by increasing score. A threshold is every distinct score from the lowest on,
    then infinity: `genuine_below` and `impostor_below` count the scores below each. For each
    impostor score, `genuine_up_to` counts the genuine scores that are at most as high.
    """

    genuine: NDArray[np.intp]
    impostor: NDArray[np.intp]
    genuine_below: NDArray[np.intp]
    impostor_below: NDArray[np.intp]
    genuine_up_to: NDArray[np.intp]

    @classmethod
    def of(
        cls, similarity: NDArray[np.float64], genuine: NDArray[np.bool_], lowest: float
    ) -> RankedScores:
        """Rank scores; impostors below `lowest` are left out."""
        ours, theirs = np.flatnonzero(genuine), np.flatnonzero(~genuine & (similarity >= lowest))
        ours = ours[np.argsort(similarity[ours], kind="stable")]
        theirs = theirs[np.argsort(similarity[theirs], kind="stable")]
        threshold = np.append(np.unique(similarity[similarity >= lowest]), np.inf)
        return cls(
            genuine=ours,
            impostor=theirs,
            genuine_below=np.searchsorted(similarity[ours], threshold, side="left"),
            impostor_below=np.searchsorted(similarity[theirs], threshold, side="left"),
            genuine_up_to=np.searchsorted(similarity[ours], similarity[theirs], side="right"),
        )

    def rates(
        self,
        genuine: NDArray[np.integer[Any]],
        impostor: NDArray[np.integer[Any]],
        total_impostor: NDArray[np.int64],
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the rates of draws, and whether the ranked scores determine them.

        The weights of each pair of `self.genuine` and `self.impostor` in each draw, shape (draws,
        pairs), are of a type that holds their sums; `total_impostor` is the weight of all
        impostors, those left out included. The rates are the EER and the FNMR at each of
        `FMR_LIMITS`; NaN where a draw has no pairs of a kind.
        """
        below_g, below_i = _cumulated(genuine), _cumulated(impostor)
        total_g, total_i = below_g[:, -1], total_impostor
        total_ranked = below_i[:, -1]
        rows = np.arange(len(genuine))
        rates = np.full((rows.size, 1 + len(FMR_LIMITS)), np.nan)
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


def _cumulated(weights: NDArray[np.integer[Any]]) -> NDArray[np.integer[Any]]:
    """Return the weight of the first 0, 1, 2, … pairs, of shape (rows, pairs + 1)."""
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
