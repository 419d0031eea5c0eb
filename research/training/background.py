"""What the image of a print shows beside it, and the ideal ridges of the print itself."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.errors import ImageError
from fpmatch.lab.synthesis.contact import outline_radius
from fpmatch.lab.synthesis.noise import smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.impression import Impression
    from fpmatch.lab.synthesis.master import Master
    from fpmatch.lab.synthesis.sensor import Sensor

    Grey = NDArray[np.uint8]
    Mask = NDArray[np.bool_]

BACKGROUNDS: Final = ("own", "none", "dark", "vignette")
CROP_PX: Final = (110, 260)  # between which the side of a crop begins
CROP_INSIDE: Final = 0.97  # share of it that must be print
CROP_STEP: Final = 0.87  # by which it shrinks until it is
MIN_CROP_PX: Final = 64
LEVELS: Final = (-0.1, 0.7)  # of a dark background, from the dark lines to the bright ones


def other_background(image: Grey, inside: Mask, kind: str, rng: np.random.Generator) -> Grey:
    """Replace the background of an image (H, W) of a print; raise ImageError for an unknown kind.

    `inside` is True where the finger touches the sensor. The kind "own" leaves the image; "none"
    cuts out a square that the print fills; "dark" puts noise between the grey levels of dark lines
    and of nearly bright ones beside the print; "vignette" darkens the corners.
    """
    if kind not in BACKGROUNDS:
        raise ImageError(f"no background {kind!r}: there are {', '.join(BACKGROUNDS)}")
    if kind == "own" or not inside.any():
        return image
    if kind == "none":
        return _cropped(image, inside, rng)
    changed = _darkened(image, inside, rng) if kind == "dark" else _vignetted(image, rng)
    return np.asarray(np.clip(np.rint(changed), 0, 255), np.uint8)


def _cropped(image: Grey, inside: Mask, rng: np.random.Generator) -> Grey:
    y, x = (np.partition(axis, len(axis) // 2)[len(axis) // 2] for axis in np.nonzero(inside))
    side = float(rng.uniform(*CROP_PX))
    while True:
        half = max(side, MIN_CROP_PX) / 2
        top, left = max(0, int(y - half)), max(0, int(x - half))
        square = slice(top, int(y + half)), slice(left, int(x + half))
        if side < MIN_CROP_PX or inside[square].mean() > CROP_INSIDE:
            return np.ascontiguousarray(image[square])
        side *= CROP_STEP


def _darkened(image: Grey, inside: Mask, rng: np.random.Generator) -> NDArray[np.float32]:
    core = cv2.erode(inside.astype(np.float32), np.ones((9, 9), np.uint8))
    share = cv2.GaussianBlur(core, (0, 0), rng.uniform(2, 8))
    low, high = np.percentile(image[inside], [5, 95])
    ground = low + (high - low) * rng.uniform(*LEVELS)
    ground = ground + rng.uniform(1, 12) * rng.standard_normal(image.shape)
    ground += rng.uniform(0, 10) * smooth_noise(image.shape, rng.uniform(1, 30), rng)
    return np.asarray(share * image + (1 - share) * ground, np.float32)


def _vignetted(image: Grey, rng: np.random.Generator) -> NDArray[np.float32]:
    rows, columns = image.shape
    y, x = np.linspace(-1, 1, rows)[:, None], np.linspace(-1, 1, columns)
    y0, x0 = rng.uniform(-0.3, 0.3, 2)
    out = np.clip((x - x0) ** 2 + (y - y0) ** 2 - 0.2, 0, None)
    return np.asarray(image * np.clip(1 - rng.uniform(0.4, 1) * out, 0.02, 1), np.float32)


def vary_platen(sensor: Sensor, rng: np.random.Generator) -> Sensor:
    """Return a sensor with another background, vignette, stripes, residue and frame."""
    return replace(
        sensor,
        paper_variation=rng.uniform(0, 8),
        vignette=rng.uniform(0, 60),
        stripes=rng.uniform(0, 2) if rng.random() < 0.3 else 0.0,
        residue=rng.uniform(0, 1.6) if rng.random() < 0.5 else 0.0,
        frame=sensor.frame * rng.integers(0, 2),
    )


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
