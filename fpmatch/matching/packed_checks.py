"""Checks of prepared prints that come from a file: no number in them leads out of an array."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.prints.bit_descriptors import UNKNOWN_BIN

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

MAX_MINUTIAE: Final = 256  # that a byte can number
# Beyond what is ever packed, and far from where a kernel's numbers would overflow:
MAX_CELLS: Final = 1 << 24  # of a print, and rows and columns
MAX_INDEX: Final = 1 << 16  # of a minutia in its template
MAX_PX: Final = float(1 << 16)  # of a minutia from the origin, at 500 dpi
STEPS_PX: Final = (1e-2, 1e6)
SCALES: Final = (1e-2, 1e2)  # 500 / dpi
UNIT_TOLERANCE: Final = 1e-3  # of the square of a unit vector's length


def is_sound(arrays: Mapping[str, NDArray[Any]]) -> bool:
    """Return whether every index and size in the arrays of `PreparedPrints` lies within them."""
    minutiae, cells = arrays["minutiae_start"], arrays["cell_start"]
    n, of_print, size = np.diff(minutiae), np.diff(cells), arrays["neighbour"].shape[1]
    for starts, length, most, array in (
        (minutiae, n, MAX_MINUTIAE, arrays["xy"]),
        (cells, of_print, MAX_CELLS, arrays["cell"]),
    ):
        if len(starts) != len(arrays["step"]) + 1 or starts[0] or starts[-1] != len(array):
            return False
        if (length < 0).any() or (length > most).any():
            return False
    shape = arrays["shape"].astype(np.int64)
    rising = np.diff(arrays["index"], prepend=-1) > 0
    rising[minutiae[:-1][n > 0]] = True  # the first minutia of a print
    checks = (
        (shape >= 0) & (shape <= MAX_CELLS),
        shape[:, 0] * shape[:, 1] == of_print,
        (arrays["inside"] >= 0) & (arrays["inside"] <= of_print),
        np.abs(arrays["xy"]) <= MAX_PX,
        _is_unit(arrays["direction"]),
        _is_within(arrays["step"], STEPS_PX),
        _is_within(arrays["to_500dpi"], SCALES),
        (arrays["index"] >= 0) & (arrays["index"] < MAX_INDEX) & rising,
        arrays["count"] <= size,
        _most_of_each(arrays["neighbour"].ravel(), size * minutiae) < np.maximum(n, 1),
        arrays["orientation_bins"] <= UNKNOWN_BIN,
        arrays["has_flow"] <= 1,
        arrays["has_ridges"] <= 1,
    )
    return all(bool(check.all()) for check in checks)


def _is_unit(vectors: NDArray[np.float32]) -> NDArray[np.bool_]:
    with np.errstate(over="ignore", invalid="ignore"):
        squares: NDArray[np.float32] = np.einsum("ij,ij->i", vectors, vectors)
        unit: NDArray[np.bool_] = np.abs(squares - np.float32(1.0)) < UNIT_TOLERANCE
    return unit


def _is_within(values: NDArray[np.float64], bounds: tuple[float, float]) -> NDArray[np.bool_]:
    return (values >= bounds[0]) & (values <= bounds[1])


def _most_of_each(values: NDArray[Any], starts: NDArray[np.int64]) -> NDArray[Any]:
    """Return the greatest of the values of each print; 0 for one that has none."""
    most = np.zeros(len(starts) - 1, values.dtype)
    some = np.flatnonzero(np.diff(starts))
    if len(some):
        most[some] = np.maximum.reduceat(values, starts[some])
    return most
