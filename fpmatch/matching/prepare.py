"""What a matcher needs of one template, computed once however often it is compared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from fpmatch.matching.neighbourhood import NeighbourhoodParameters, Neighbourhoods, neighbourhoods
from fpmatch.minutiae import STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.minutiae import Minutiae, RidgeField, Template


@dataclass(frozen=True, slots=True)
class PreparationParameters:
    """Set what is prepared; lengths in pixels at 500 dpi.

    Parameters
    ----------
    max_minutiae : int
        Minutiae that take part, at most; of more, those of best quality.
    hull_step_px : float
        Side of the cells of the region that stands for the print where a template has no field.
    max_hull_cells : int
        Cells along a side of that region; where the minutiae reach farther, its cells are larger.
    """

    max_minutiae: int = 200
    hull_step_px: float = 16.0
    max_hull_cells: int = 512


@dataclass(frozen=True, slots=True, eq=False)
class PreparedTemplate:
    """Hold one template ready for comparison, in pixels at 500 dpi with y pointing up.

    Parameters
    ----------
    points : ndarray of float64, shape (4, N)
        x, y and the unit vector of the direction of each minutia that takes part.
    quality : ndarray of float64, shape (N,)
        Their quality, 0 to 1.
    index : ndarray of int32, shape (N,)
        Their places among the template's minutiae.
    neighbourhoods : Neighbourhoods
        Their neighbourhoods.
    region : Region
        Where the print is, and how its ridges run there.
    zoom : float
        500 / dpi.
    key : bytes
        The content, by which two templates are put in order, so that a comparison does not depend
        on which of them is the probe.
    """

    points: NDArray[np.float64]
    quality: NDArray[np.float64]
    index: NDArray[np.int32]
    neighbourhoods: Neighbourhoods
    region: Region
    zoom: float
    key: bytes

    def __len__(self) -> int:
        return len(self.index)


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """Hold where a print is, on square cells, and the ridge orientation there.

    Parameters
    ----------
    step : float
        Side of a cell.
    mask : ndarray of uint8, shape (rows, columns)
        1 where the print is.
    flow : ndarray of float64, shape (2, rows, columns)
        Cosine and sine of twice the ridge orientation; 0 where unknown.
    cells : ndarray of float64, shape (4, K)
        x, y, and the two of `flow`, of the K cells inside the mask.
    has_flow : bool
        Whether the orientation is known at all.
    """

    step: float
    mask: NDArray[np.uint8]
    flow: NDArray[np.float64]
    cells: NDArray[np.float64]
    has_flow: bool

    @property
    def area(self) -> float:
        """Area of the print."""
        return float(self.cells.shape[1] * self.step**2)

    def holds(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which of the points lie inside the print."""
        rows, columns = self.mask.shape
        column = np.floor(x / self.step)
        row = np.floor(-y / self.step)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        held = np.zeros(len(x), bool)
        held[inside] = self.mask[row[inside].astype(np.intp), column[inside].astype(np.intp)] > 0
        return held


def prepare(
    template: Template,
    parameters: PreparationParameters | None = None,
    neighbourhood: NeighbourhoodParameters | None = None,
) -> PreparedTemplate:
    """Prepare a template for comparison.

    Parameters
    ----------
    template : Template
        Minutiae of one impression; its ridge field is used where it has one.
    parameters : PreparationParameters, optional
        Limits.
    neighbourhood : NeighbourhoodParameters, optional
        Size and tolerances of the neighbourhoods.

    Returns
    -------
    PreparedTemplate
        What `fpmatch.matching.matchers.unit_circle` compares.
    """
    p = parameters or PreparationParameters()
    zoom = STANDARD_DPI / template.dpi
    index = _best(template.minutiae, p.max_minutiae)
    minutiae = template.minutiae.take(index)
    angle = minutiae.angle.astype(np.float64)
    points = np.empty((4, len(minutiae)))
    points[0] = minutiae.x * zoom
    points[1] = -minutiae.y * zoom
    points[2], points[3] = np.cos(angle), np.sin(angle)
    if template.field is not None:
        region = _region_of_field(template.field, zoom)
    else:
        region = _region_of_hull(points, p)
    quality = minutiae.quality / 100.0
    return PreparedTemplate(
        points=points,
        quality=quality,
        index=index,
        neighbourhoods=neighbourhoods(points, neighbourhood),
        region=region,
        zoom=zoom,
        key=b"".join(
            part.tobytes() for part in (points, quality, region.cells, np.float64(region.step))
        ),
    )


def _best(minutiae: Minutiae, count: int) -> NDArray[np.int32]:
    """Return the indices, in order, of the `count` minutiae of best quality."""
    best = np.argsort(-minutiae.quality.astype(np.int32), kind="stable")[:count]
    return np.sort(best).astype(np.int32)


def _region_of_field(field: RidgeField, zoom: float) -> Region:
    doubled = 2.0 * field.orientation.astype(np.float64)
    flow = np.stack([np.cos(doubled), np.sin(doubled)]) * field.mask
    return _region(field.step * zoom, field.mask.astype(np.uint8), flow, has_flow=True)


def _region_of_hull(points: NDArray[np.float64], p: PreparationParameters) -> Region:
    """Return the convex hull of the minutiae as a region of unknown orientation."""
    inside = (points[0] >= 0) & (points[1] <= 0)
    x, y = points[0, inside], -points[1, inside]
    reach = max(x.max(initial=0.0), y.max(initial=0.0))
    step = max(p.hull_step_px, reach / p.max_hull_cells)
    corners = np.floor(np.column_stack([x, y]) / step).astype(np.int32)
    size = (corners.max(axis=0) + 1) if len(corners) else np.array([1, 1])
    mask = np.zeros((int(size[1]), int(size[0])), np.uint8)
    if len(corners):
        cv2.fillConvexPoly(mask, cv2.convexHull(corners), 1)
    return _region(step, mask, np.zeros((2, *mask.shape)), has_flow=False)


def _region(
    step: float, mask: NDArray[np.uint8], flow: NDArray[np.float64], *, has_flow: bool
) -> Region:
    row, column = np.nonzero(mask)
    cells = np.stack(
        [(column + 0.5) * step, -(row + 0.5) * step, flow[0, row, column], flow[1, row, column]]
    )
    return Region(step, mask, np.ascontiguousarray(flow), np.ascontiguousarray(cells), has_flow)
