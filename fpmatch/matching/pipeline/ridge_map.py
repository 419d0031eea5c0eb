"""Where the ridges of two prints agree: the cells that the score compared, one by one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.matching.pipeline._kernels._ridge_kernel import RidgeCorrelator
from fpmatch.matching.pipeline.alignment import aligner_of
from fpmatch.matching.pipeline.parameters import USUAL

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.pipeline.alignment import Alignment
    from fpmatch.matching.pipeline.parameters import MatchParameters
    from fpmatch.matching.prints.prepared import PreparedTemplate

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
        """Return the object that ``fpmatch verify --json --ridge-map`` prints."""
        chosen = self.compared
        columns = np.column_stack([self.x[chosen], self.y[chosen]]).round(2)
        values = self.correlation[chosen].round(4)
        return {
            "mean": self.mean,
            "cell_px": self.cell_px,
            "rotation_deg": self.rotation_deg,
            "cells": [[*at, value] for at, value in zip(columns.tolist(), values, strict=True)],
        }


def ridge_map(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    parameters: MatchParameters = USUAL,
    *,
    swapped: bool,
) -> RidgeMap | None:
    """Return how the ridges of prints A and B agree under an alignment; None if nowhere compared.

    The reference is B, or A where `swapped`.
    """
    correlator, compared = correlate(a, b, alignment, parameters)
    if not compared:
        return None
    region, reference = a.region, a if swapped else b
    cells = np.empty((3, *region.code.shape))
    correlator.copy_cells(a.for_kernels(), cells)
    correlation, x, y = cells
    c, s, _, _ = alignment.transform.tolist()
    side, rotation = region.step, 0.0
    if swapped:
        missing = np.where(np.isnan(correlation), np.nan, 0.0)
        rows, columns = (np.arange(count) + 0.5 for count in region.code.shape)
        x = (region.first_column + columns)[None, :] * side - 0.5 * a.to_500dpi + missing
        y = 0.5 * a.to_500dpi - (region.first_row + rows)[:, None] * side + missing
    else:
        side, rotation = side * math.hypot(c, s), 0.0 - math.degrees(math.atan2(s, c))
    zoom = 1.0 / reference.to_500dpi
    return RidgeMap(correlation, x * zoom, -y * zoom, side * zoom, rotation)


def correlate(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    parameters: MatchParameters = USUAL,
) -> tuple[RidgeCorrelator, int]:
    """Correlate the ridges of two prints under an alignment of A with B.

    Every cell of A is mapped to B by the mesh of pairs around it. It and the cells
    that touch it may be shifted by up to half a ridge period to where they agree best.

    Returns
    -------
    RidgeCorrelator
        The correlator that has compared them: its ``correlation`` is the mean of the cells, -1 to
        1; about 0.2 for different fingers whose ridges have the same orientation. 0 where there
        are none.
    int
        Number of cells compared: those that lie in both prints, at least three of the cells that
        touch them beside them; 0 where either print does not show its ridges.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> from fpmatch.matching.pipeline.alignment import identity_alignment
    >>> from fpmatch.matching.prints.prepare import prepare
    >>> bare = prepare(Template(Minutiae(x=[20, 60], y=[20, 30], angle=[0, 1]), 100, 100))
    >>> correlator, cells = correlate(bare, bare, identity_alignment(bare.points))
    >>> correlator.correlation, cells
    (0.0, 0)
    """
    correlator = RidgeCorrelator(len(b))
    c, s, x, y = alignment.transform.tolist()
    aligner = aligner_of(a.points, b.points, parameters)
    with np.errstate(over="ignore", invalid="ignore"):  # of transforms that lead nowhere
        aligner.impose(alignment.partner, c, s, x, y)
        cells = correlator.compare(a.for_kernels(), b.for_kernels(), aligner.mesh, c, s, x, y)
    return correlator, cells
