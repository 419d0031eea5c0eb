"""Names for the array types of the stages, and percentiles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Grey = NDArray[np.uint8]
    Floats = NDArray[np.float32]
    Doubles = NDArray[np.float64]
    Ints = NDArray[np.int32]
    Mask = NDArray[np.bool_]


def percentiles(values: NDArray[np.floating[Any]], *percents: float) -> Doubles:
    """Return percentiles of finite values (..., N) along the last axis, shape (P, ...).

    They are those of `np.percentile` by default, with linear interpolation, which imports numpy.ma
    and so costs more than one image.
    """
    last = values.shape[-1] - 1
    place = np.array(percents) * (last / 100)
    below = place.astype(np.intp)
    beyond = np.minimum(below + 1, last)
    ordered = np.partition(values, sorted({*below.tolist(), *beyond.tolist()}), axis=-1)
    low, high = (np.moveaxis(ordered[..., k], -1, 0).astype(np.float64) for k in (below, beyond))
    share = (place - below).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(low + share * (high - low))
