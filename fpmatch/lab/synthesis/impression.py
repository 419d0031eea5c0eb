"""One impression of a finger, and its ground truth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.synthesis.contact import is_legible, outline_radius, press, smear, stain
from fpmatch.lab.synthesis.noise import random_streams
from fpmatch.lab.synthesis.sensor import develop, framed
from fpmatch.lab.synthesis.skin import detailed_skin, skin_of
from fpmatch.lab.synthesis.warp import draw_warp
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.master import Master
    from fpmatch.lab.synthesis.presets import Preset
    from fpmatch.lab.synthesis.sensor import Sensor
    from fpmatch.lab.synthesis.warp import Warp
    from fpmatch.templates.minutiae import Minutiae

    Field = NDArray[np.float32]  # a value a pixel

BEYOND_THE_MASTER: Final = -1.0  # relief outside its arrays
SMEARED: Final = 0.5  # share of a smear from which nothing is legible
ROUNDED_PX: Final = 16.0  # width of the rounded border of the print
ON_PRINT: Final = 0.5  # share from which skin may touch
FADING: Final = 0.25  # radius over which damp fades towards the outline
FITTED_EVERY_PX: Final = 3  # step between the pixels that the similarity is fitted to


@dataclass(frozen=True, slots=True, eq=False)
class Impression:
    """One image and its ground truth; coordinates are pixels of the image."""

    image: NDArray[np.uint8] = field(repr=False)  # dark ridges on a light ground, (h, w)
    dpi: float
    preset: str
    warp: Warp  # exact map from the master to the image
    transform: Similarity  # nearest to it over the contact
    residual_rms_px: float  # root mean square distance of the two
    minutiae: Minutiae = field(repr=False)  # the master's that fall in the image, visible or not
    master: NDArray[np.int64] = field(repr=False)  # index of each among the master's, (N,)
    visible: NDArray[np.bool_] = field(repr=False)  # whether it is visible, (N,)


def make_impression(master: Master, number: int, preset: Preset, sensor: Sensor) -> Impression:
    """Press a finger on a sensor once; impressions are numbered from 1, none depends on another."""
    import cv2  # noqa: PLC0415

    streams = random_streams(master.seed, master.finger, number, range(31, 36))
    placing, pressing, smearing, sensing, taking = streams
    px = sensor.px
    warp = draw_warp(master.relief.shape, sensor.shape, sensor.dpi, placing, preset.placement)
    pixels = _pixels(sensor.shape)
    origin = warp.to_master(pixels).reshape(*sensor.shape, 2).astype(np.float32)
    radius = outline_radius(warp.upright(pixels)).reshape(sensor.shape)
    skin = detailed_skin(master) if preset.detailed else skin_of(master)
    rough = master.relief + preset.texture * (skin.relief - master.relief)
    to_border = cv2.distanceTransform(master.silhouette.astype(np.uint8), cv2.DIST_L2, 5)
    share = np.asarray(np.clip(to_border / ROUNDED_PX, 0, 1), np.float32)
    on_print = _sampled(share, origin, 0.0) * (1 - framed(sensor))
    creases = _sampled(skin.creases, origin, 0.0)
    contact = press(radius, on_print, creases, pressing, preset.pressure, px)
    still = _sampled(rough, origin, BEYOND_THE_MASTER)
    relief, smeared = smear(still, smearing, preset.smear, px)
    touching = (radius < 1) & (on_print > ON_PRINT)
    damp = stain(on_print * np.clip((1 - radius) / FADING, 0, 1), smearing, preset.smear, px)
    details = taking if preset.detailed else None
    image = develop(relief, contact, sensor, sensing, damp, details)
    transform, residual = _best_similarity(touching, origin)
    moved = _moved(master.minutiae, warp)
    last = sensor.width - 1, sensor.height - 1
    inside = np.flatnonzero(((moved.xy >= 0) & (moved.xy <= last)).all(axis=1))
    moved = moved.take(inside)
    column, row = np.floor(moved.xy).astype(np.intp).T
    visible = is_legible(moved.xy, contact, px) & (smeared[row, column] < SMEARED)
    minutiae = moved, inside.astype(np.int64), visible
    return Impression(image, sensor.dpi, preset.name, warp, transform, residual, *minutiae)


def _pixels(shape: tuple[int, ...], step: int = 1) -> NDArray[np.float64]:
    """Return x and y of every `step`-th pixel, row by row, shape (N, 2)."""
    y, x = np.mgrid[: shape[0] : step, : shape[1] : step]
    return np.column_stack([x.ravel(), y.ravel()]).astype(np.float64)


def _sampled(layer: Field, origin: Field, beyond: float) -> Field:
    """Return a layer of the master at `origin` (h, w, 2), and `beyond` outside it."""
    import cv2  # noqa: PLC0415

    x, y = origin[..., 0], origin[..., 1]
    sampled = cv2.remap(layer, x, y, cv2.INTER_CUBIC, borderValue=beyond)
    return np.asarray(sampled, np.float32)


def _best_similarity(touching: NDArray[np.bool_], origin: Field) -> tuple[Similarity, float]:
    """Fit the similarity from master to image over the contact; return it and its residual."""
    every = (slice(None, None, FITTED_EVERY_PX),) * 2
    pixels = _pixels(touching.shape, FITTED_EVERY_PX)
    used = touching[every].ravel()
    if not used.any():  # no skin in the image: use all of it
        used[:] = True
    source, target = origin[every].reshape(-1, 2)[used].astype(np.float64), pixels[used]
    transform = Similarity.fit(source, target)
    off = np.square(target - transform.apply(source)).sum(axis=1)
    return transform, math.sqrt(float(off.mean()))


def _moved(minutiae: Minutiae, warp: Warp) -> Minutiae:
    """Map the master's minutiae to the image; each direction by a point one pixel ahead."""
    start = minutiae.xy.astype(np.float64)
    ahead = start + np.column_stack([np.cos(minutiae.angle), -np.sin(minutiae.angle)])
    start, ahead = warp.from_master(start), warp.from_master(ahead)
    dx, dy = (ahead - start).T.astype(np.float32)
    x, y = start.T.astype(np.float32)
    return replace(minutiae, x=x, y=y, angle=np.arctan2(-dy, dx))
