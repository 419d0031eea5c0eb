"""Percentiles without `np.percentile`, which imports numpy.ma and so costs more than one image."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def percentiles(values: NDArray[np.floating[Any]], *percents: float) -> NDArray[np.float64]:
    """Return percentiles of finite values (..., N) along the last axis, shape (P, ...).

    They are those of `np.percentile` by default: linear interpolation between two values.
    """
    last = values.shape[-1] - 1
    place = np.array(percents) * (last / 100)
    below = place.astype(np.intp)
    beyond = np.minimum(below + 1, last)
    ordered = np.partition(values, sorted({*below.tolist(), *beyond.tolist()}), axis=-1)
    low, high = (np.moveaxis(ordered[..., k], -1, 0).astype(np.float64) for k in (below, beyond))
    share = (place - below).reshape(-1, *[1] * (values.ndim - 1))
    found: NDArray[np.float64] = low + share * (high - low)
    return found
