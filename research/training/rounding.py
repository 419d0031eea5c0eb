"""Rounding of trained numbers, so that other orders of summing give the same files."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray


def round_significant(values: Iterable[float], digits: int) -> NDArray[np.float64]:
    """Return values rounded to a number of significant digits.

    Examples
    --------
    >>> round_significant([123.456, 0.001234], 3).tolist()
    [123.0, 0.00123]
    """
    return np.array([float(f"{value:.{digits}g}") for value in values])
