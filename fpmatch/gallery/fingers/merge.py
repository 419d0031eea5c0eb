"""Merge aligned impressions into one template.

Minutiae that coincide become one. A minutia gains quality with each impression that contains it,
loses quality with each that covers its place without it, and is dropped if few contain it.
Each cell takes its ridge orientation and its ridges from the impression in which it lies farthest
from the border.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import (
    CELL_BITS,
    STANDARD_DPI,
    Minutiae,
    MinutiaKind,
    RidgeField,
    Template,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

# lengths in pixels at 500 dpi
SAME_PX: Final = 10.0  # minutiae of two impressions no farther apart are the same,
SAME_DEG: Final = 30.0  # where their directions differ by no more
MARGIN_PX: Final = 12.0  # inside an impression a place must lie to be covered by it
LEAST_SHARE: Final = 0.4  # of the impressions that cover a minutia: fewer, and it is left out
DOUBT: Final = 0.7  # share of a minutia's lack of quality that one more impression leaves
STEP_PX: Final = 16.0  # side of the cells of the ridge field
APART: Final = 1e6  # cost of minutiae that are not the same


def points_at_500_dpi(template: Template) -> Floats:
    """Return the positions of the minutiae as the matcher compares them, float64, shape (N, 2)."""
    return template.minutiae.xy.astype(np.float64) * (STANDARD_DPI / template.dpi)


def merge_templates(
    templates: Sequence[Template], poses: Iterable[Similarity]
) -> tuple[Template, list[Similarity]]:
    """Make one template at 500 dpi of aligned impressions, at least one.

    The `poses` map each, at 500 dpi, to a common frame, without change of scale. The template has a
    ridge field where all impressions have one, with ridges where all have them. Also return what
    maps the pixels of each impression to those of the template.

    Examples
    --------
    >>> one = Template(Minutiae(x=[10, 60], y=[10, 40], angle=[0, 1], quality=[50, 50]), 90, 90)
    >>> merged, _ = merge_templates([one, one], [Similarity(), Similarity(tx=2.0)])
    >>> merged.minutiae.x.tolist(), merged.minutiae.quality.tolist()
    ([11.0, 61.0], [65, 65])
    """
    placed = list(zip(templates, poses, strict=True))
    corners = np.concatenate([_corners(template, pose) for template, pose in placed])
    low = np.floor(corners.min(axis=0) / STEP_PX) * STEP_PX
    columns, rows = np.ceil((corners.max(axis=0) - low) / STEP_PX).astype(int).tolist()
    to_frame = Similarity(tx=-float(low[0]), ty=-float(low[1]))
    placed = [(template, to_frame.after(pose)) for template, pose in placed]
    field = None
    if all(template.field is not None for template in templates):
        field = _merged_field(placed, (max(rows, 1), max(columns, 1)))
    width, height = (max(1, round(count * STEP_PX)) for count in (columns, rows))
    merged = Template(_merged_minutiae(placed), width, height, STANDARD_DPI, field)
    return merged, [pose.after(Similarity(STANDARD_DPI / t.dpi)) for t, pose in placed]


def _corners(template: Template, pose: Similarity) -> Floats:
    to_500dpi = STANDARD_DPI / template.dpi
    width, height = template.width * to_500dpi, template.height * to_500dpi
    return pose.apply([[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]])


def _merged_minutiae(placed: Sequence[tuple[Template, Similarity]]) -> Minutiae:
    """Return the minutiae of all impressions, those of one place and direction as one.

    The columns of a sum over the minutiae that are one: x, y, cosine and sine, how many of each
    kind, quality, how many.
    """
    kinds = len(MinutiaKind)
    sums = np.empty((0, 4 + kinds + 2))
    for template, pose in placed:
        new = _columns(template, pose)
        row, column = _same(new, sums)
        sums[column] += new[row]
        sums = np.concatenate([sums, np.delete(new, row, axis=0)])
    seen = sums[:, -1]
    xy, direction = sums[:, :2] / seen[:, None], sums[:, 2:4]
    covered = np.sum([_covers(*one, xy) for one in placed], axis=0)
    share = seen / np.maximum(covered, seen)
    mean = sums[:, -2] / seen
    quality = mean * np.sqrt(share) + (100.0 - mean) * (1.0 - DOUBT ** (seen - 1)) * share
    kept = share >= LEAST_SHARE
    return Minutiae(
        x=xy[kept, 0],
        y=xy[kept, 1],
        angle=np.arctan2(direction[kept, 1], direction[kept, 0]),
        kind=sums[kept, 4 : 4 + kinds].argmax(axis=1),
        quality=np.clip(quality[kept], 1.0, 100.0),
    )


def _columns(template: Template, pose: Similarity) -> Floats:
    m = template.minutiae
    xy = points_at_500_dpi(template)
    angle = m.angle.astype(np.float64) - pose.rotation  # on screen, where y points down
    kind = np.eye(len(MinutiaKind))[m.kind]
    moved = pose.apply(xy) if len(m) else xy
    return np.column_stack(
        [moved, np.cos(angle), np.sin(angle), kind, m.quality.astype(np.float64), np.ones(len(m))]
    )


def _same(new: Floats, sums: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which of the new minutiae are which of those that are there, one to one."""
    from scipy.optimize import linear_sum_assignment  # noqa: PLC0415
    from scipy.spatial.distance import cdist  # noqa: PLC0415

    apart = cdist(new[:, :2], sums[:, :2] / sums[:, -1:])
    length = np.maximum(np.hypot(sums[:, 2], sums[:, 3]), 1e-9)
    agreement = (new[:, 2:4] @ sums[:, 2:4].T) / length
    apart[(apart > SAME_PX) | (agreement < np.cos(np.deg2rad(SAME_DEG)))] = APART
    row, column = linear_sum_assignment(apart)
    same = apart[row, column] < APART
    return row[same], column[same]


def _covers(template: Template, pose: Similarity, xy: Floats) -> NDArray[np.bool_]:
    """Return which places of the frame lie inside an impression."""
    depth, bit = _depth(template)
    inside = np.zeros(len(xy), bool)
    if len(xy):
        column, row = np.floor(pose.inverse().apply(xy) / bit).astype(int).T
        there = (row >= 0) & (column >= 0) & (row < depth.shape[0]) & (column < depth.shape[1])
        inside[there] = depth[row[there], column[there]] > MARGIN_PX
    return inside


def _depth(template: Template) -> tuple[NDArray[np.float32], float]:
    """Return how far inside the print each bit of its cells lies, and the side of a bit.

    Where there is no ridge field the convex hull of the minutiae stands for the print.
    """
    to_500dpi = STANDARD_DPI / template.dpi
    if template.field is not None:
        bit = template.field.step * to_500dpi / CELL_BITS
        cell = np.ones((CELL_BITS, CELL_BITS), np.uint8)
        mask = np.kron(template.field.mask.astype(np.uint8), cell)
    else:
        bit = STEP_PX / CELL_BITS
        places = np.floor(points_at_500_dpi(template) / bit).astype(np.int32)
        places = places[(places >= 0).all(axis=1)]
        mask = np.zeros((*(places.max(axis=0, initial=0)[::-1] + 1),), np.uint8)
        if len(places):
            cv2.fillConvexPoly(mask, cv2.convexHull(places), 1)
    inside = cv2.distanceTransform(np.pad(mask, 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
    return (inside * bit).astype(np.float32), bit


def _merged_field(
    placed: Sequence[tuple[Template, Similarity]], shape: tuple[int, int]
) -> RidgeField:
    """Return cells that each show the impression in which they lie farthest from the border."""
    deepest = np.zeros(shape, np.float32)
    orientation = np.zeros(shape, np.float32)
    picture = np.zeros((*shape, CELL_BITS, CELL_BITS), np.uint8)
    for template, pose in placed:
        assert template.field is not None
        depth, bit = _depth(template)
        cell = np.ones((CELL_BITS, CELL_BITS), np.float32)
        planes = (depth, np.kron(template.field.orientation, cell), template.field.bits)
        there, flow, bits = (
            _cells(_warped(plane.astype(np.float32), pose, bit, shape, how))
            for plane, how in zip(
                planes, (cv2.INTER_LINEAR, cv2.INTER_NEAREST, cv2.INTER_LINEAR), strict=True
            )
        )
        inside = there.mean(axis=(2, 3)) * ((there > 0).mean(axis=(2, 3)) >= 0.5)
        better = inside > deepest
        deepest[better] = inside[better]
        middle = flow[:, :, CELL_BITS // 2, CELL_BITS // 2]
        orientation[better] = np.mod(middle[better] - pose.rotation, np.pi)
        picture[better] = bits[better] > 0.5
    known = all(
        template.field is not None and template.field.ridges is not None for template, _ in placed
    )
    packed = np.packbits(picture.reshape(*shape, -1), axis=2, bitorder="little")
    ridges = packed.view("<u8")[..., 0] if known else None
    orientation[orientation >= np.float32(np.pi)] = 0.0
    return RidgeField(STEP_PX, orientation, deepest > 0, ridges)


def _warped(
    plane: NDArray[np.float32], pose: Similarity, bit: float, shape: tuple[int, int], how: int
) -> NDArray[np.float32]:
    """Return a plane of an impression, a value a bit, as it lies in the frame, a value a bit."""
    side = STEP_PX / CELL_BITS
    back = pose.inverse().matrix
    matrix = np.empty((2, 3))
    matrix[:, :2] = back[:, :2] * (side / bit)
    # the middle of a bit is half a bit from its corner, on either side
    matrix[:, 2] = (back[:, :2] @ (0.5 * side, 0.5 * side) + back[:, 2]) / bit - 0.5
    size = (shape[1] * CELL_BITS, shape[0] * CELL_BITS)
    moved = cv2.warpAffine(plane, matrix, size, flags=how | cv2.WARP_INVERSE_MAP)
    return np.asarray(moved, np.float32)


def _cells(plane: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a plane by cells, shape (rows, columns, 8, 8)."""
    rows, columns = plane.shape[0] // CELL_BITS, plane.shape[1] // CELL_BITS
    return plane.reshape(rows, CELL_BITS, columns, CELL_BITS).swapaxes(1, 2)
