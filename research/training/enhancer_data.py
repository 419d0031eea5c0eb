"""Training pairs of the enhancer: images of synthetic prints, and the relief of their masters.

Conditions are drawn from a wider range than those of any preset, and the sensors' grey levels vary
too, so that the network does not depend on how one sensor renders one kind of skin.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.image.extract import resample
from fpmatch.image.preprocess.normalize import normalize
from fpmatch.lab.synthesis.contact import SmearParameters
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.noise import smooth_noise
from fpmatch.lab.synthesis.presets import PRESETS, Preset
from fpmatch.lab.synthesis.sensor import SENSORS
from research.training.background import ridge_target, vary_platen

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.sensor import Sensor

STEPS_PER_UNIT: Final = 40.0  # normalised pixels are kept as int8: from -3 to 3
STEPS_OF_TARGET: Final = 120.0  # and so are targets, from -1 to 1
WRECKED: Final = Preset(
    "wrecked",
    replace(PRESETS["hard"].placement, shift=(0, 40), tip_only=0.1),
    replace(
        PRESETS["hard"].pressure,
        dryness=(-0.9, 0.95),
        unevenness=0.35,
        tilt=(0, 0.6),
        beading=(0.2, 0.7),
        wear=(0.1, 0.65),
        max_scratches=12,
        max_spots=7,
    ),
    SmearParameters(chance=0.5, share=(0.05, 0.25), stain=(0.0, 0.4)),
    texture=1.4,
    detailed=True,
)
MIXTURE: Final = ((PRESETS["easy"], 0.1), (PRESETS["normal"], 0.25), (PRESETS["hard"], 0.25),
                  (WRECKED, 0.25), (PRESETS["rolled"], 0.15))  # fmt: skip
PURPOSE: Final = 71  # of these random numbers, beside those of synthesis


@dataclass(frozen=True, slots=True)
class Pair:
    """A normalised picture and the relief that it shows, both int8, shape (H, W)."""

    picture: NDArray[np.int8]
    relief: NDArray[np.int8]
    inside: NDArray[np.bool_]


def make_pairs(seed: int, fingers: int, workers: int) -> Iterator[Pair]:
    """Make one pair on each sensor for every finger, in order."""
    with ProcessPoolExecutor(workers) as pool:
        for pairs in pool.map(partial(_pairs_of_finger, seed), range(fingers), chunksize=4):
            yield from pairs


def _pairs_of_finger(seed: int, finger: int) -> list[Pair]:
    master = make_master(seed, finger, PRESETS["rolled"].master)
    pairs = []
    for number, sensor in enumerate(SENSORS.values(), start=1):
        rng = np.random.default_rng([seed, finger, number, PURPOSE])
        preset = MIXTURE[rng.choice(len(MIXTURE), p=[share for _, share in MIXTURE])][0]
        varied = _varied(sensor, rng)
        impression = make_impression(master, number, preset, varied)
        relief, inside = ridge_target(impression, master)
        grey, _ = resample(_disturbed(impression.image, rng), varied.dpi)
        size = (grey.shape[1], grey.shape[0])
        scaled = cv2.resize(relief, size, interpolation=cv2.INTER_LINEAR)
        shown = cv2.resize(inside.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
        pixels = normalize(grey).pixels
        pairs.append(
            Pair(
                np.rint(pixels * STEPS_PER_UNIT).astype(np.int8),
                np.rint(np.clip(scaled, -1, 1) * STEPS_OF_TARGET).astype(np.int8),
                shown.astype(bool),
            )
        )
    return pairs


def _varied(sensor: Sensor, rng: np.random.Generator) -> Sensor:
    """Return a sensor with other optics and grey levels."""
    span = sensor.paper - sensor.ink
    varied = replace(
        sensor,
        ink=sensor.ink + span * rng.uniform(0, 0.35),
        softness=sensor.softness * rng.uniform(0.7, 1.8),
        blur=rng.uniform(0.4, 1.3),
        noise=sensor.noise * rng.uniform(0.5, 4.0),
        ink_variation=sensor.ink_variation * rng.uniform(0.5, 2.0),
    )
    return vary_platen(varied, rng)


def _disturbed(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return a picture with another tone curve, ghosts of an older print, and a frame at times."""
    grey = image.astype(np.float32)
    if rng.random() < 0.3:  # an older print on the glass, faint
        ghost = np.roll(image[::-1, :: rng.choice([-1, 1])], rng.integers(0, 200), axis=1)
        ghost = cv2.GaussianBlur(ghost, (0, 0), 0.8).astype(np.float32)
        grey -= rng.uniform(0.03, 0.2) * (np.median(ghost[0]) - ghost).clip(0)
    grey = 255 * (grey.clip(0, 255) / 255) ** np.exp(rng.uniform(-0.5, 0.5))
    if rng.random() < 0.5:
        grey += rng.uniform(0, 12) * smooth_noise(image.shape, rng.uniform(1, 4), rng)
    if rng.random() < 0.2:  # the border of the platen
        side = int(rng.integers(1, 30))
        axis, end = rng.integers(0, 2), rng.integers(0, 2)
        border = np.moveaxis(grey, axis, 0)[::-1] if end else np.moveaxis(grey, axis, 0)
        border[:side] = rng.uniform(0, 255)
    return np.asarray(np.clip(np.rint(grey), 0, 255), np.uint8)
