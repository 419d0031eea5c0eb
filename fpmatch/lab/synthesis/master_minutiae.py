"""The minutiae of a master print, without those that are mere flaws of its ridges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.templates.minutiae import Minutiae, MinutiaKind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Field = NDArray[np.float32]
    Mask = NDArray[np.bool_]

_BRANCHES: Final = {MinutiaKind.ENDING: 1, MinutiaKind.BIFURCATION: 3}  # = crossing number


@dataclass(frozen=True, slots=True)
class MinutiaeParameters:
    """Set the limits of flaws; lengths in local ridge periods."""

    branch: float = 1.1  # a shorter ridge is a spur or an island
    spacing: float = 0.9  # two nearer minutiae are one flaw
    along: float = 1.4  # and two on one ridge: a break, an island, a hole, a spur
    across: float = 0.5  # distance across ridges up to which they are on one ridge


def list_minutiae(
    relief: Field, orientation: Field, period: Field, silhouette: Mask, p: MinutiaeParameters
) -> Minutiae:
    """List the minutiae of a clean relief, by crossing numbers on the skeleton of its ridges.

    All arrays are (H, W): relief, positive on ridges; ridge orientation in radians,
    counter-clockwise; ridge period in pixels; area in which minutiae are listed. Spurs, islands,
    breaks, holes and minutiae too near each other are left out, as an examiner would. Minutiae are
    ordered from top to bottom.
    """
    from skimage.morphology import skeletonize  # noqa: PLC0415

    skeleton = np.asarray(skeletonize(relief > 0), np.bool_)  # type: ignore[no-untyped-call]
    crossing = crossing_numbers(skeleton)
    margin = int(np.ceil(period.max() * max(p.branch, 1.0)))
    off_border = np.zeros_like(silhouette)
    off_border[margin:-margin, margin:-margin] = True
    listed: list[tuple[float, float, float, float, float]] = []
    for kind, branches in _BRANCHES.items():
        for row, column in np.argwhere(skeleton & off_border & (crossing == branches)):
            ways = _ways_out(skeleton, row, column, p.branch * float(period[row, column]))
            axis = float(orientation[row, column])
            ahead = sum(np.sign((way * np.exp(-1j * axis)).real) for way in ways)
            direction = axis if ahead > 0 else axis + np.pi  # to most of the ways
            listed.append((column, row, direction, kind, len(ways) == branches))
    x, y, angle, codes, whole = np.array(listed, np.float32).reshape(-1, 5).T
    minutiae = Minutiae(x, y, angle, codes.astype(np.uint8))
    place = y.astype(np.intp), x.astype(np.intp)
    minutiae = minutiae.take(
        silhouette[place] & (whole > 0) & ~_too_near(minutiae, period[place], p)
    )
    return minutiae.take(np.lexsort((minutiae.x, minutiae.y)))


def crossing_numbers(skeleton: Mask) -> NDArray[np.int64]:
    """Return half the number of changes from pixel to pixel around each pixel, shape (H, W)."""
    padded = np.pad(skeleton, 1).astype(np.int64)
    rows, columns = skeleton.shape
    ring = ((0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0), (0, 0))
    around = np.stack([padded[top : top + rows, left : left + columns] for top, left in ring])
    return np.asarray(np.abs(around - np.roll(around, 1, axis=0)).sum(axis=0) // 2)


def _ways_out(skeleton: Mask, row: int, column: int, reach: float) -> list[complex]:
    """Return where the skeleton from a pixel leaves the disk of radius `reach` around it.

    The points are x + iy from the pixel, y up; branches that end within are not among them.
    """
    from scipy import ndimage  # noqa: PLC0415

    side = int(np.ceil(reach))
    window = skeleton[row - side : row + side + 1, column - side : column + side + 1]
    y, x = np.mgrid[side : -side - 1 : -1, -side : side + 1]
    distance = np.hypot(x, y)
    eight = np.ones((3, 3))
    whole, _ = ndimage.label(window & (distance <= reach), eight)
    own = whole == whole[side, side]
    rim, count = ndimage.label(own & (distance > reach - np.sqrt(2)), eight)
    return [complex(x[rim == i].mean(), y[rim == i].mean()) for i in range(1, count + 1)]


def _too_near(minutiae: Minutiae, period: Field, p: MinutiaeParameters) -> Mask:
    """Return which minutiae have another so near that the two are one flaw."""
    place = minutiae.x.astype(np.float64) - 1j * minutiae.y
    along = np.exp(-1j * minutiae.angle.astype(np.float64))[:, None]
    between = (place[None] - place[:, None]) * along / period[:, None]
    np.fill_diagonal(between, np.inf)
    on_one_ridge = (np.abs(between.real) < p.along) & (np.abs(between.imag) < p.across)
    near = (np.abs(between) < p.spacing) | on_one_ridge
    return np.asarray((near | near.T).any(axis=1))
