"""The measure of unlinkability of ISO/IEC 30136."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def d_sys(mated: ArrayLike, non_mated: ArrayLike, *, omega: float = 1.0) -> float:
    """Return how far judgements tell pairs of one finger from others: 0 not at all, 1 always.

    Both distributions are estimated by histograms of the same bins, which contain about as many
    judgements each, a bin for each value where there are few: about the square root of the number
    of mated ones. `mated`, `non_mated` (M,): judgements of pairs of templates of one finger, and of
    different fingers. `omega`: ratio of the prior probabilities of both.

    By Gomez-Barrero, Galbally, Rathgeb, Busch: General framework to evaluate unlinkability in
    biometric template protection systems, IEEE TIFS 13(6), 2018, eq. 4 to 8.
    """
    m, n = np.sort(np.asarray(mated, float)), np.sort(np.asarray(non_mated, float))
    edges = _edges(m, n)
    of_mated, of_others = _shares(m, edges), _shares(n, edges)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = omega * of_mated / of_others
        local = np.where(ratio > 1, 2 * ratio / (1 + ratio) - 1, 0.0)
    local[(of_others == 0) & (of_mated > 0)] = 1.0
    return float((of_mated * local).sum())


def _edges(mated: NDArray[np.float64], non_mated: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lower ends of the bins."""
    bins = max(2, round(len(mated) ** 0.5))
    pooled = np.concatenate([np.quantile(s, np.arange(bins) / bins) for s in (mated, non_mated)])
    return np.unique(pooled)


def _shares(values: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return which share of the values lies in each bin."""
    bins = np.searchsorted(edges, values, "right")
    return np.bincount(bins, minlength=len(edges) + 1) / len(values)
