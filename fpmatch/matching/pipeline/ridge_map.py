"""Where the ridges of two prints agree: the cells that the score compared, one by one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


IMPOSTOR_MEAN: Final = 0.27
"""Mean agreement of the ridges of different fingers, under the transform that aligns them best."""


@dataclass(frozen=True, slots=True, eq=False)
class RidgeMap:
    """The agreement of the ridges of two prints, cell by cell.

    The cells are squares of one of the prints, of about two ridge periods. Each is compared, with
    the cells that touch it, where the mesh of pairs maps it, shifted by up to half a ridge period.
    Its correlation is 2·p - 1, where p is the share of samples that are ridge in both prints or
    valley in both: 1 where the ridges coincide, on average `IMPOSTOR_MEAN` for different fingers.

    Parameters
    ----------
    correlation : ndarray of float64, shape (rows, columns)
        Correlation of each cell, -1 to 1; NaN where the ridges were not compared.
    x, y : ndarray of float64, shape (rows, columns)
        Centres of the cells, in pixels of the reference; NaN where they were not compared.
    cell_px : float
        Side of a cell, in pixels of the reference.
    rotation_deg : float
        Rotation of the rows of cells in the reference, clockwise on screen.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch.matching.pipeline.ridge_map import RidgeMap
    >>> found = RidgeMap(np.array([[0.5, np.nan]]), np.zeros((1, 2)), np.zeros((1, 2)), 16, 0)
    >>> found.mean, found.cells
    (0.5, 1)
    """

    correlation: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    cell_px: float
    rotation_deg: float

    @property
    def compared(self) -> NDArray[np.bool_]:
        """Which cells were compared, shape (rows, columns)."""
        return ~np.isnan(self.correlation)

    @property
    def cells(self) -> int:
        """Number of cells compared."""
        return int(np.count_nonzero(self.compared))

    @property
    def mean(self) -> float:
        """Mean correlation, which the score is made of; 0 where no cell was compared."""
        return float(np.nanmean(self.correlation)) if self.cells else 0.0

    @property
    def corners(self) -> NDArray[np.float64]:
        """Corners of the compared cells in pixels of the reference, clockwise, (cells, 4, 2)."""
        angle, half = math.radians(self.rotation_deg), 0.5 * self.cell_px
        across = half * np.array([math.cos(angle), math.sin(angle)])
        down = half * np.array([-math.sin(angle), math.cos(angle)])
        square = np.array([-across - down, across - down, across + down, down - across])
        chosen = self.compared
        middle = np.column_stack([self.x[chosen], self.y[chosen]])
        return np.asarray(middle[:, None, :] + square)

    def as_dict(self) -> dict[str, Any]:
        """Return its values as JSON has them, with the compared cells alone."""
        chosen = self.compared
        columns = np.column_stack([self.x[chosen], self.y[chosen]]).round(2)
        values = self.correlation[chosen].round(4)
        return {
            "mean": self.mean,
            "cell_px": self.cell_px,
            "rotation_deg": self.rotation_deg,
            "cells": [[*at, value] for at, value in zip(columns.tolist(), values, strict=True)],
        }
