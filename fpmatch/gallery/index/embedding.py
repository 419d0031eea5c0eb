"""Embeddings of prints: 128 small numbers each, which a network makes of minutiae and orientation.

The embeddings of two impressions of a finger point in nearly the same direction; between the
embeddings of different fingers, any angle occurs. The network has learned this on synthetic prints
(``python -m research train embedding``). It sees a print as a picture of 32 by 32 cells of 16
pixels, around the middle of the print's area: ridge orientation, area, and minutiae with their
directions. No minutia of one print has to be found in the other, so that mates with few edges in
common are found, too.
"""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.base.network import Network
from fpmatch.matching.prints.print_area import ORIENTATIONS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepare import PreparedTemplate

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


def picture(print_: PreparedTemplate, side: int = SIDE) -> NDArray[np.float32]:
    """Return a print as the network sees it, (6, `side`, `side`).

    The channels are the ridge orientation as a unit vector at twice its angle, the area, the sums
    of the minutiae's directions as unit vectors, and their number. Of what lies between cells, each
    gets a share.
    """
    region = print_.region
    vectors = _VECTORS[region.code]
    if not region.has_flow:
        vectors[..., :2] = 0.0
    shown = np.zeros((CHANNELS, side, side), np.float32)
    # from a place in the picture to one among the cells of the area
    scale, offset = CELL_PX / region.step, np.zeros(2)
    if vectors.size:
        area = cv2.moments((region.code > 0).view(np.uint8), binaryImage=True)
        middle = np.array([area["m10"], area["m01"]]) / max(area["m00"], 1.0)
        offset = middle - scale * (0.5 * side - 0.5)
        matrix = np.array([[scale, 0.0, offset[0]], [0.0, scale, offset[1]]])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        shown[:3] = cv2.warpAffine(vectors, matrix, (side, side), flags=flags).transpose(2, 0, 1)
    x, y, c, s = print_.points
    places = np.stack([x / region.step - region.first_column, -y / region.step - region.first_row])
    u, v = (places - 0.5 - offset[:, None]) / scale
    column, row = np.floor(u), np.floor(v)
    right, down = u - column, v - row
    # a cell beyond each border has what is not shown
    wide = side + 2
    first = np.clip(row + 1, 0, side) * wide + np.clip(column + 1, 0, side)
    inside = (column >= -1) & (column < side) & (row >= -1) & (row < side)
    shares = np.stack([1.0 - right, right]) * np.stack([1.0 - down, down])[:, None] * inside
    cell = first.astype(np.intp) + np.array([[[0], [1]], [[wide], [wide + 1]]])
    for channel, weight in enumerate((c, s, 1.0), start=3):
        counted = np.bincount(cell.ravel(), (shares * weight).ravel(), wide * wide)
        shown[channel] = counted.reshape(wide, wide)[1:-1, 1:-1]
    return shown


def embeddings(prints: Iterable[PreparedTemplate]) -> NDArray[np.int8]:
    """Return the embeddings of prints, (N, 128): unit vectors in steps of 1/300.

    Raises FpmatchError if the file of the network is missing, damaged or of another version.
    """
    given = iter(prints)
    parts = []
    while pictures := [picture(print_) for print_ in islice(given, AT_ONCE)]:
        parts.append(_embedded(pictures))
    return np.concatenate([np.zeros((0, LENGTH), np.int8), *parts])


def _embedded(pictures: Sequence[NDArray[np.float32]]) -> NDArray[np.int8]:
    made = _NETWORK(np.stack(pictures))
    made /= np.maximum(np.linalg.norm(made, axis=1, keepdims=True), 1e-9)
    rounded: NDArray[np.int8] = np.clip(np.rint(STEPS * made), -127, 127).astype(np.int8)
    return rounded
