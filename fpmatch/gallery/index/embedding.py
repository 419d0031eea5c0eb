"""Embeddings of prints: 128 small numbers each, which a network makes of minutiae and orientation.

The embeddings of two impressions of a finger point in nearly the same direction; between the
embeddings of different fingers, any angle occurs. The network has learned this on synthetic prints
(``python -m research train embedding``). It sees a print as a picture of 32 by 32 cells of 16
pixels, around the middle of the print's area: ridge orientation, area, and minutiae with their
directions. No minutia of one print has to be found in the other, so that mates with few edges in
common are found, too.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.base.network import Network
from fpmatch.matching.constants import ORIENTATIONS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate, PrintArea

LENGTH: Final = 128
SIDE: Final = 32  # cells of a picture
CELL_PX: Final = 16.0
CHANNELS: Final = 6
STEPS: Final = 300.0  # of a unit vector, in which its numbers are rounded
AT_ONCE: Final = 64  # prints
NETWORK_FILE: Final = Path(__file__).with_name("embedding.onnx")
NETWORK_SHA256: Final = "793d5198010a79dac5e16639942da4c05cff32ea001ede0d7e3e95ff3f013a3e"
_NETWORK: Final = Network(NETWORK_FILE, NETWORK_SHA256)


def _unit_vectors() -> NDArray[np.float32]:
    """Return for each code of orientation the unit vector at twice its angle, and 1 in the area."""
    angle = 2.0 * np.pi / ORIENTATIONS * (np.arange(256) - 1.0)
    vectors = np.stack([np.cos(angle), np.sin(angle), np.ones(256)], axis=1)
    vectors[0] = 0.0
    return np.asarray(vectors, np.float32)


_VECTORS: Final = _unit_vectors()


def pictures(prints: Sequence[PreparedTemplate], side: int = SIDE) -> NDArray[np.float32]:
    """Return prints as the network sees them, (N, 6, `side`, `side`).

    The channels are the ridge orientation as a unit vector at twice its angle, the area, the sums
    of the minutiae's directions as unit vectors, and their number. Of what lies between cells, each
    gets a share.
    """
    shown = np.zeros((len(prints), CHANNELS, side, side), np.float32)
    points = [np.empty((4, 0))]
    for print_, of_one in zip(prints, shown, strict=True):
        region = print_.region
        # from a place in the picture to one among the cells of the area
        scale, left, top = CELL_PX / region.step, 0.0, 0.0
        if region.code.size:
            area = cv2.moments((region.code > 0).view(np.uint8), binaryImage=True)
            cells, half = max(area["m00"], 1.0), scale * (0.5 * side - 0.5)
            left, top = area["m10"] / cells - half, area["m01"] / cells - half
            matrix = np.array([[scale, 0.0, left], [0.0, scale, top]])
            of_one[:3] = _orientation(region, matrix, side)
        x, y, c, s = print_.points
        u = (x / region.step - region.first_column - 0.5 - left) / scale
        v = (-y / region.step - region.first_row - 0.5 - top) / scale
        points.append(np.stack([u, v, c, s]))
    number = np.repeat(np.arange(len(prints)), [len(print_) for print_ in prints])
    shown[:, 3:] = _counted(number, np.concatenate(points, axis=1), len(prints), side)
    return shown


def _orientation(region: PrintArea, matrix: NDArray[np.float64], side: int) -> NDArray[np.float32]:
    """Return ridge orientation and area in the cells of a picture, (3, `side`, `side`)."""
    vectors = _VECTORS.take(region.code, axis=0)
    if not region.has_flow:
        vectors[..., :2] = 0.0
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    seen = cv2.warpAffine(vectors, matrix, (side, side), flags=flags)
    return np.asarray(seen.transpose(2, 0, 1), np.float32)


def _counted(
    number: NDArray[np.intp], points: NDArray[np.float64], prints: int, side: int
) -> NDArray[np.float64]:
    """Return the directions and the number of minutiae in the cells of pictures, (N, 3, ...).

    `number` is that of the picture of each of the `points`: place, cosine and sine.
    """
    u, v, c, s = points
    column, row = np.floor(u), np.floor(v)
    right, down = u - column, v - row
    # a cell beyond each border has what is not shown
    wide = side + 2
    first = np.clip(row + 1, 0, side) * wide + np.clip(column + 1, 0, side)
    inside = (column >= -1) & (column < side) & (row >= -1) & (row < side)
    shares = np.stack([1.0 - right, right]) * np.stack([1.0 - down, down])[:, None] * inside
    cell = first.astype(np.intp) + wide * wide * number
    cell = (cell + np.array([[[0], [1]], [[wide], [wide + 1]]])).ravel()
    counted = np.stack(
        [np.bincount(cell, (shares * weight).ravel(), prints * wide**2) for weight in (c, s, 1.0)],
        axis=1,
    )
    inner = counted.reshape(prints, wide, wide, 3)[:, 1:-1, 1:-1]
    return np.asarray(inner.transpose(0, 3, 1, 2), np.float64)


def embeddings(prints: Sequence[PreparedTemplate]) -> NDArray[np.int8]:
    """Return the embeddings of prints, (N, 128): unit vectors in steps of 1/300.

    Raises FpmatchError if the file of the network is missing, damaged or of another version.
    """
    parts = [np.zeros((0, LENGTH), np.int8)]
    for first in range(0, len(prints), AT_ONCE):
        parts.append(_embedded(pictures(prints[first : first + AT_ONCE])))
    return np.concatenate(parts)


def turned_embeddings(print_: PreparedTemplate) -> NDArray[np.int8]:
    """Return the embeddings of a print and of it turned by 90, 180 and 270 degrees, (4, 128).

    Raises FpmatchError as `embeddings` does.
    """
    shown = pictures([print_])[0]
    turned = [shown]
    for _ in range(3):
        u, v, area, c, s, number = np.rot90(shown, axes=(1, 2))
        shown = np.stack([-u, -v, area, -s, c, number])  # u and v are at twice the angle
        turned.append(shown)
    return _embedded(np.stack(turned))


def _embedded(shown: NDArray[np.float32]) -> NDArray[np.int8]:
    made = _NETWORK(shown)
    made /= np.maximum(np.linalg.norm(made, axis=1, keepdims=True), 1e-9)
    embedded: NDArray[np.int8] = np.clip(np.rint(STEPS * made), -127, 127).astype(np.int8)
    return embedded
