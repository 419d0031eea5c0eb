"""The ideal ridges of an image: the target of enhancement."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from fpmatch.lab.synthesis.contact import outline_radius

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.impression import Impression
    from fpmatch.lab.synthesis.master import Master


def ridge_target(
    impression: Impression, master: Master
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Map a master's relief to one of its impressions, of shape (h, w).

    Returns the height of the skin, -1 in valleys to 1 on ridges and 0 off the print, as if it
    touched everywhere, and where the finger touches the sensor.
    """
    shape = impression.image.shape
    y, x = np.mgrid[: shape[0], : shape[1]]
    pixels = np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)
    origin = impression.warp.to_master(pixels).reshape(*shape, 2).astype(np.float32)
    touching = outline_radius(impression.warp.upright(pixels)).reshape(shape) < 1
    on_print = cv2.remap(
        master.silhouette.astype(np.uint8), origin[..., 0], origin[..., 1], cv2.INTER_NEAREST
    )
    inside = touching & (on_print > 0)
    relief = cv2.remap(master.relief, origin[..., 0], origin[..., 1], cv2.INTER_LINEAR)
    return np.asarray(relief * inside, np.float32), inside
