"""The ridges that a picture shows, without all that hides them: what enhancement aims at."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from fpmatch.synthesis.contact import outline_radius

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.synthesis.impression import Impression
    from fpmatch.synthesis.master import Master


def ridge_target(
    impression: Impression, master: Master
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Carry a master's relief to where it lies in one of its impressions.

    Parameters
    ----------
    impression : Impression
        The picture and how it was taken.
    master : Master
        The finger that it shows.

    Returns
    -------
    ndarray of float32, shape (h, w)
        Height of the skin at every pixel of the picture, -1 in valleys to 1 on ridges, as if it
        touched everywhere; 0 off the print.
    ndarray of bool, shape (h, w)
        Where the finger lies on the sensor.

    Examples
    --------
    >>> from fpmatch.synthesis.impression import make_impression
    >>> from fpmatch.synthesis.master import MasterParameters, make_master
    >>> from fpmatch.synthesis.presets import PRESETS
    >>> from fpmatch.synthesis.sensor import Sensor
    >>> finger = make_master(7, 1, MasterParameters(shape=(160, 120)))
    >>> made = make_impression(finger, 1, PRESETS["clean"], Sensor("small", 100, 120))
    >>> relief, inside = ridge_target(made, finger)
    >>> dark = made.image < 128
    >>> bool((dark == (relief > 0))[inside].mean() > 0.8)
    True
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
