"""Percentiles of pixels, for what reads one image and is gone.

`np.percentile` and `np.median` say the same, and import numpy.ma first, which takes longer than the
image.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def percentiles(values: NDArray[np.floating[Any]], *percents: float) -> NDArray[np.float64]:
    """Return percentiles along the last axis, as `np.percentile` does by default.

    Parameters
    ----------
    values : ndarray of float, shape (..., N)
        Finite values, N at least 1.
    *percents : float
        Which, 0 to 100; 50 is the median.

    Returns
    -------
    ndarray of float64, shape (len(percents), ...)
        The percentiles, between two values where they fall between.

    Examples
    --------
    >>> percentiles(np.array([4.0, 1.0, 2.0, 3.0]), 50, 100)
    array([2.5, 4. ])
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
