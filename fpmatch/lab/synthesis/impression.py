"""One impression of a finger, and its ground truth, which a finger's file has as JSON."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.lab.synthesis.contact import is_legible, outline_radius, press, smear, stain
from fpmatch.lab.synthesis.noise import random_streams
from fpmatch.lab.synthesis.sensor import develop, framed
from fpmatch.lab.synthesis.skin import detailed_skin, skin_of
from fpmatch.lab.synthesis.warp import draw_warp
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.master import Master
    from fpmatch.lab.synthesis.presets import Preset
    from fpmatch.lab.synthesis.sensor import Sensor
    from fpmatch.lab.synthesis.warp import Warp
    from fpmatch.templates.minutiae import Minutiae

    Field = NDArray[np.float32]  # a value a pixel

TRUTH_FOLDER: Final = "truth"
NODE_EVERY_PX: Final = 12  # of the displacement field, at 500 dpi
POSITION_DIGITS: Final = 2
FACTOR_DIGITS: Final = 8  # of scale and radians: a millionth of a pixel across a picture
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


def finger_truth(master: Master, impressions: Mapping[str, dict[str, Any]]) -> bytes:
    """Return the content of a finger's truth file: JSON in one line.

    `impressions` holds the result of `impression_truth` by the stem of each image's name.
    """
    rows, columns = master.relief.shape
    truth = {
        "finger": master.finger,
        "seed": master.seed,
        "pattern": master.pattern.value,
        "master_size": [columns, rows],
        "minutiae": _columns(master.minutiae),
        "cores": _rounded(master.cores),
        "deltas": _rounded(master.deltas),
        "impressions": dict(impressions),
    }
    text = json.dumps(truth, separators=(",", ":"), allow_nan=False)
    return f"{text}\n".encode("ascii")


def impression_truth(impression: Impression, sensor: Sensor, sha256: str) -> dict[str, Any]:
    """Return the ground truth of one impression, ready for JSON.

    `displacement` belongs to `transform` as it is rounded there: a point p of the image comes from
    ``transform.inverse().apply(p + displacement(p))`` of the master.
    """
    t = impression.transform
    transform = Similarity(
        round(t.scale, FACTOR_DIGITS),
        round(math.remainder(t.rotation, 2 * math.pi), FACTOR_DIGITS),
        round(t.tx, POSITION_DIGITS + 2),
        round(t.ty, POSITION_DIGITS + 2),
    )
    height, width = impression.image.shape
    step = max(1, round(NODE_EVERY_PX * impression.dpi / 500))
    # one node more than needed on each side, so that the image is interpolated from nodes around it
    y, x = (np.arange(-1, (side - 1) // step + 3) * float(step) for side in (height, width))
    nodes = np.stack(np.meshgrid(x, y), axis=-1)
    placed = transform.apply(impression.warp.to_master(nodes.reshape(-1, 2)))
    shift = placed.reshape(nodes.shape) - nodes
    return {
        "preset": impression.preset,
        "sensor": sensor.name,
        "size": [width, height],
        "dpi": impression.dpi,
        "sha256": sha256,
        "transform": {
            "scale": transform.scale,
            "rotation": transform.rotation,
            "rotation_deg": round(transform.rotation_deg, 4),
            "tx": transform.tx,
            "ty": transform.ty,
        },
        "residual_rms_px": round(impression.residual_rms_px, 3),
        "minutiae": _columns(impression.minutiae)
        | {"master": impression.master.tolist(), "visible": impression.visible.tolist()},
        "displacement": {
            "step": step,
            "dx": _rounded(shift[..., 0]),
            "dy": _rounded(shift[..., 1]),
        },
    }


def _columns(minutiae: Minutiae) -> dict[str, list[Any]]:
    """Return minutiae as columns: x and y in pixels, direction in degrees, ISO kind."""
    degrees = np.degrees(minutiae.angle.astype(np.float64)).round(POSITION_DIGITS) % 360
    return {
        "x": _rounded(minutiae.x),
        "y": _rounded(minutiae.y),
        "angle_deg": degrees.tolist(),
        "kind": minutiae.kind.tolist(),
    }


def _rounded(values: NDArray[np.floating]) -> list[Any]:
    # adding 0 turns -0.0, which JSON distinguishes, into 0.0
    return (values.astype(np.float64).round(POSITION_DIGITS) + 0.0).tolist()  # type: ignore[no-any-return]
