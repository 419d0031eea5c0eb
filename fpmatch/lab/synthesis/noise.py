"""Random streams, and smooth random fields for what varies slowly over a print."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

NO_IMPRESSION: Final = 0  # in the place of an impression's number: impressions count from 1
# Of the cubic B-spline sum of unit noise along both axes: the variance along one is 11/23.
SPLINE_DEVIATION = 11 / 23


def random_streams(
    seed: int, finger: int, impression: int, purposes: range
) -> list[np.random.Generator]:
    """Return a stream of random numbers for each purpose, so that none influences another.

    Purposes are 1 to 6 for a master, 21 to 27 for its skin and 31 to 35 for an impression.
    """
    return [np.random.default_rng([seed, finger, impression, purpose]) for purpose in purposes]


def smooth_noise(
    shape: tuple[int, int], extent_px: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Draw a smooth random field: normal values on a grid, interpolated by cubic B-splines.

    The grid has a spacing of `extent_px` pixels; values about twice as far apart are independent.
    Mean 0, standard deviation about 1.
    """
    rows, columns = (int(side / extent_px) + 4 for side in shape)
    values = rng.standard_normal((rows, columns))
    tall = interpolated(values, shape[0], extent_px)
    return interpolated(tall.T, shape[1], extent_px).T / SPLINE_DEVIATION


def interpolated(values: NDArray[np.float64], length: int, extent_px: float) -> NDArray[np.float64]:
    """Return the cubic B-spline of values (N, ...) `extent_px` apart, at 0 to `length` - 1."""
    position = np.arange(length) / extent_px
    cell = position.astype(np.intp)
    t = (position - cell)[:, None]
    inner = (4 - 6 * t**2 + 3 * t**3) / 6, (1 + 3 * t + 3 * t**2 - 3 * t**3) / 6
    weights = (1 - t) ** 3 / 6, *inner, t**3 / 6
    total = np.zeros((length, values.shape[1]))
    for ahead, weight in enumerate(weights):
        total += weight * values[cell + ahead]
    return total
