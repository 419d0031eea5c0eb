"""Training of the polarity of prints, on synthetic fingers.

Conditions are drawn from a wider range than those of any preset: moisture, roughness, grey levels,
sharpness and background. It is logistic regression without a constant term, so that a print and its
negative are one example.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import click
import cv2
import numpy as np
from scipy.optimize import minimize

from fpmatch._version import __version__
from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.image.extract import resample
from fpmatch.image.quality.line_cues import (
    FARTHEST_CUE,
    LINE_CUES,
    WEIGHTS_FILE,
    evidence_of_cues,
    line_cues,
)
from fpmatch.image.quality.measures import LinearWeights
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.noise import smooth_noise
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from research.commands import PATH, Command, workers
from research.training.background import BACKGROUNDS, other_background, ridge_target, vary_platen
from research.training.rounding import round_significant

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.presets import Preset
    from fpmatch.lab.synthesis.sensor import Sensor

FINGERS: Final = 240
SEED: Final = 901
TRAINED_PRESETS: Final = ("easy", "normal", "hard")
BACKGROUND_SHARES: Final = (0.35, 0.3, 0.25, 0.1)  # of the BACKGROUNDS
IMPRESSIONS: Final = 4  # of a finger
DRYNESS: Final = (-0.6, 0.7)
TEXTURE: Final = (0.3, 1.6)  # factor of pores
GRAIN: Final = (0.2, 1.6)  # factor of roughness
INK: Final = (0.0, 0.35)  # share of the contrast that ink lacks
SOFTNESS: Final = (0.7, 4.0)  # factor
BLUR: Final = (0.4, 1.5)
NOISE: Final = (0.3, 4.0)  # factor
TONE: Final = (-0.5, 0.5)  # logarithm of the exponent of the tone curve
SPOTS: Final = (0.0, 12.0)  # deviation of coarse noise
PENALTY: Final = 0.01  # on the squared weights of the scaled cues, for each example
DIGITS: Final = 4


def cues_of_finger(
    seed: int, finger: int, impressions: int = IMPRESSIONS
) -> list[NDArray[np.float64]]:
    """Return the cues, shape (7,), of impressions of one finger on sensors of all kinds."""
    master = make_master(seed, finger)
    found = []
    for number in range(1, impressions + 1):
        rng = np.random.default_rng([seed, finger, number])
        sensor = _varied_sensor(list(SENSORS.values())[int(rng.integers(len(SENSORS)))], rng)
        preset = PRESETS[TRAINED_PRESETS[int(rng.integers(len(TRAINED_PRESETS)))]]
        impression = make_impression(master, number, _varied_preset(preset, rng), sensor)
        _, inside = ridge_target(impression, master)
        image = _disturbed(impression.image, rng)
        image = other_background(
            image, inside, str(rng.choice(BACKGROUNDS, p=BACKGROUND_SHARES)), rng
        )
        cues = line_cues(resample(image, sensor.dpi)[0])
        if cues is not None:
            found.append(cues)
    return found


def fit_polarity(
    cues: Sequence[NDArray[np.float64]], provenance: Mapping[str, Any] | None = None
) -> LinearWeights:
    """Fit the weights of the cues, shape (7,) each, of prints with dark ridges."""
    measured = np.array(cues, np.float64).reshape(-1, len(LINE_CUES))
    spread = round_significant(np.sqrt((measured**2).mean(axis=0)), DIGITS)
    design = np.clip(measured / spread, -FARTHEST_CUE, FARTHEST_CUE)

    def loss(weight: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        total = design @ weight
        cost = np.logaddexp(0.0, -total).mean() + PENALTY * weight @ weight / 2
        slope = design.T @ (0.5 * (np.tanh(total / 2) - 1.0)) / len(design) + PENALTY * weight
        return float(cost), slope

    fitted = minimize(loss, np.zeros(len(LINE_CUES)), jac=True, method="L-BFGS-B").x
    origin = {**(provenance or {}), "prints": len(design), "fpmatch": __version__}
    weight = round_significant(np.asarray(fitted, np.float64), DIGITS)
    return LinearWeights(LINE_CUES, np.zeros(len(LINE_CUES)), spread, weight, 0.0, origin)


def _varied_preset(preset: Preset, rng: np.random.Generator) -> Preset:
    pressure = preset.pressure
    dryness = float(rng.uniform(*DRYNESS))
    grain = pressure.grain * float(rng.uniform(*GRAIN))
    return replace(
        preset,
        texture=preset.texture * float(rng.uniform(*TEXTURE)),
        pressure=replace(pressure, dryness=(dryness, dryness), grain=grain),
    )


def _varied_sensor(sensor: Sensor, rng: np.random.Generator) -> Sensor:
    varied = replace(
        sensor,
        ink=sensor.ink + (sensor.paper - sensor.ink) * rng.uniform(*INK),
        softness=sensor.softness * np.exp(rng.uniform(*np.log(SOFTNESS))),
        blur=rng.uniform(*BLUR),
        noise=sensor.noise * rng.uniform(*NOISE),
        ink_variation=sensor.ink_variation * rng.uniform(0.2, 2.0),
        ink_fading=sensor.ink_fading * rng.uniform(0.0, 1.2),
    )
    return vary_platen(varied, rng)


def _disturbed(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return an image with another tone curve and, half of the time, coarse noise."""
    grey = 255 * (image / 255.0) ** np.exp(rng.uniform(*TONE))
    if rng.random() < 0.5:
        grey += rng.uniform(*SPOTS) * smooth_noise(image.shape, rng.uniform(1, 4), rng)
    return np.asarray(np.clip(np.rint(grey), 0, 255), np.uint8)


@click.command(cls=Command)
@click.option("--into", type=PATH, default=WEIGHTS_FILE, help="File to write.")
@click.option("--fingers", default=FINGERS, show_default=True, help="Synthetic fingers.")
@workers
def command(into: Path, fingers: int, workers: int | None) -> None:
    """Train the weights of the polarity of prints on synthetic fingers.

    Every finger is pressed on sensors of all kinds, under conditions of all kinds; the weights
    compare its dark lines with its bright ones. The same package writes the same file.
    """
    into.parent.mkdir(parents=True, exist_ok=True)
    check_writable(into)
    with ProcessPoolExecutor(workers, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        made = pool.map(partial(cues_of_finger, SEED), range(1, fingers + 1))
        cues = [one for of_finger in made for one in of_finger]
    provenance = {"command": "python -m research train polarity", "seed": SEED, "fingers": fingers}
    weights = fit_polarity(cues, provenance)
    atomic_write_bytes(into, weights.as_json().encode(), public=True)
    right = float((evidence_of_cues(np.array(cues), weights) > 0).mean())
    click.echo(f"{into}: {len(cues)} prints; the evidence indicates dark ridges in {right:.1%}")
