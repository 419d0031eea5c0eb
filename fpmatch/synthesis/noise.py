"""Smooth random fields: what varies slowly over a print and differs from finger to finger."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SPLINE_DEVIATION = 11 / 23  # of a cubic B-spline sum of unit noise along one axis, squared: 0.479


def smooth_noise(
    shape: tuple[int, int], extent_px: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Draw a smooth random field: normal values on a grid, joined by cubic B-splines.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns.
    extent_px : float
        Spacing of the grid in pixels: over about twice as far values forget each other.
    rng : numpy.random.Generator
        Where the values come from.

    Returns
    -------
    ndarray of float64, shape (rows, columns)
        Mean 0 and standard deviation about 1.

    Examples
    --------
    >>> field = smooth_noise((300, 200), 20.0, np.random.default_rng(1))
    >>> field.shape, bool(np.abs(np.diff(field, axis=0)).max() < 0.2)
    ((300, 200), True)
    """
    rows, columns = (int(side / extent_px) + 4 for side in shape)
    values = rng.standard_normal((rows, columns))
    tall = _along_first_axis(values, shape[0], extent_px)
    return _along_first_axis(tall.T, shape[1], extent_px).T / _SPLINE_DEVIATION


def _along_first_axis(
    values: NDArray[np.float64], length: int, extent_px: float
) -> NDArray[np.float64]:
    position = np.arange(length) / extent_px
    cell = position.astype(np.intp)
    t = (position - cell)[:, None]
    weights = (
        (1 - t) ** 3 / 6,
        (4 - 6 * t**2 + 3 * t**3) / 6,
        (1 + 3 * t + 3 * t**2 - 3 * t**3) / 6,
        t**3 / 6,
    )
    total = np.zeros((length, values.shape[1]))
    for ahead, weight in enumerate(weights):
        total += weight * values[cell + ahead]
    return total
