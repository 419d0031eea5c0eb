"""Training of the quality of prints, on synthetic fingers.

Every finger is pressed a few times with care, and then badly, each time in another way. Quality
predicts the similarity of a bad impression to the good ones, as a share of theirs to one another.
It is logistic regression on shares, in which no weight may raise the quality for a worse measure.
"""

from __future__ import annotations

import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import click
import cv2
import numpy as np
from scipy.optimize import Bounds, minimize

from fpmatch._version import __version__
from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.image.extract import assess, extract
from fpmatch.image.io.grey import GreyImage
from fpmatch.image.quality.measures import measure_quality
from fpmatch.image.quality.print_quality import (
    FEATURES,
    WEIGHTS_FILE,
    QualityWeights,
    quality_features,
    quality_score,
)
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.commands import PATH, Command, workers
from research.training.rounding import round_significant

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.image.quality.measures import QualityMeasures
    from fpmatch.lab.synthesis.master import Master
    from fpmatch.lab.synthesis.presets import Preset
    from fpmatch.lab.synthesis.sensor import Sensor

FINGERS: Final = 40
SEED: Final = 801
GOOD_IMPRESSIONS: Final = 3  # of a finger, pressed with care
FAULTS: Final = ("dry", "wet", "blurred", "partial", "small", "wrong resolution")
OTHERS: Final = ("easy", "normal", "normal", "hard", "hard", *FAULTS)
"""Presets and faults of the other impressions."""
BETTER: Final = tuple(name in {"ridges", "minutiae"} for name in FEATURES)
"""Features whose larger values are better; those of the others are worse."""
PENALTY: Final = 1e-3  # on the squared weights of the standardised features, for each example
TOLERANCE: Final = 1e-9
DIGITS: Final = 4


def spoilt_impression(
    master: Master, number: int, fault: str, sensor: Sensor, rng: np.random.Generator
) -> tuple[NDArray[np.uint8], float]:
    """Press a finger with one of `FAULTS`; return the image and the resolution claimed for it."""
    preset = PRESETS["clean"]
    if fault in {"dry", "wet"}:  # which is never even, and seldom comes alone
        dryness = rng.uniform(0.4, 1.1) * (1 if fault == "dry" else -1)
        uneven = PRESETS["hard"]
        preset = replace(uneven, pressure=replace(uneven.pressure, dryness=(dryness, dryness)))
    claimed = sensor.dpi
    if fault == "wrong resolution":
        factor = float(rng.choice([rng.uniform(0.5, 0.8), rng.uniform(1.25, 2.0)]))
        width, height = (round(side * factor) for side in (sensor.width, sensor.height))
        sensor = replace(sensor, width=width, height=height, dpi=sensor.dpi * factor)
    image = make_impression(master, number, preset, sensor).image
    if fault == "blurred":
        soft = cv2.GaussianBlur(image, (0, 0), rng.uniform(1.0, 3.2) * sensor.px)
        image = np.asarray(np.clip(soft + rng.normal(0, 1, soft.shape), 0, 255), np.uint8)
    if fault == "partial":  # the rest of the picture is bare glass
        rows = np.arange(image.shape[0]) < rng.uniform(0.35, 0.75) * image.shape[0]
        image = image.copy()
        image[rows] = np.percentile(image, 95)
    if fault == "small":
        side = round(rng.uniform(80, 200) * sensor.px)
        top, left = (max(0, (length - side) // 2) for length in image.shape)
        image = np.ascontiguousarray(image[top : top + side, left : left + side])
    return image, claimed


def examples_of_finger(seed: int, finger: int) -> tuple[list[QualityMeasures], list[float]]:
    """Press one synthetic finger well and badly, and compare."""
    rng = np.random.default_rng([seed, finger])
    sensors = list(SENSORS.values())
    master = make_master(seed, finger)
    good = [
        MATCHER.prepare(
            extract(GreyImage(_pressed(master, k + 1, PRESETS["clean"], sensors[0])[0]), dpi=500)
        )
        for k in range(GOOD_IMPRESSIONS)
    ]
    of_good = np.mean([MATCHER.compare(a, b).similarity for a, b in combinations(good, 2)])
    measures, shares = [], []
    for k, way in enumerate(OTHERS):
        number, sensor = GOOD_IMPRESSIONS + 1 + k, sensors[int(rng.integers(len(sensors)))]
        image, dpi = (
            _pressed(master, number, PRESETS[way], sensor)
            if way in PRESETS
            else spoilt_impression(master, number, way, sensor, rng)
        )
        assessed = assess(GreyImage(image), dpi)
        found = measure_quality(assessed.stages(with_maps=False))
        if found.ridges_mm2 <= 0 or not np.isfinite(quality_features(found)).all():
            continue
        prepared = MATCHER.prepare(assessed.template)
        common = [MATCHER.compare(prepared, one).similarity for one in good]
        measures.append(found)
        shares.append(min(float(np.mean(common) / of_good), 1.0))
    return measures, shares


def fit_quality(
    measures: Sequence[QualityMeasures],
    shares: Sequence[float],
) -> QualityWeights:
    """Fit the weights of the quality to prints with ridges and their shares, 0 to 1."""
    features = np.array([quality_features(f) for f in measures])
    middle, spread = round_significant(features.mean(axis=0), DIGITS), features.std(axis=0)
    spread = round_significant(np.where(spread > 0, spread, 1.0), DIGITS)
    design = np.column_stack([np.ones(len(features)), (features - middle) / spread])
    target = np.asarray(shares, np.float64)

    def loss(weight: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        total = design @ weight
        cost = (np.logaddexp(0.0, total) - target * total).mean()
        slope = design.T @ (0.5 * (1.0 + np.tanh(total / 2)) - target) / len(target)
        pull = PENALTY * np.concatenate([[0.0], weight[1:]])
        return float(cost + pull @ weight / 2), slope + pull

    start = np.zeros(1 + len(FEATURES))
    signs = np.array(BETTER)
    bounds = Bounds(
        np.append(-np.inf, np.where(signs, 0.0, -np.inf)),
        np.append(np.inf, np.where(signs, np.inf, 0.0)),
    )
    found = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds, tol=TOLERANCE)
    weight = round_significant(np.asarray(found.x, np.float64), DIGITS)
    return QualityWeights(middle, spread, weight[1:], float(weight[0]))


def weights_as_json(weights: QualityWeights, provenance: Mapping[str, Any]) -> str:
    """Return the text of the package's file of weights."""
    rows = zip(FEATURES, *(column.tolist() for column in weights[:3]), strict=True)
    features = [dict(zip(("name", "middle", "spread", "weight"), row, strict=True)) for row in rows]
    document = {"provenance": provenance, "bias": weights.bias, "features": features}
    return f"{json.dumps(document, indent=1)}\n"


def _pressed(
    master: Master, number: int, preset: Preset, sensor: Sensor
) -> tuple[NDArray[np.uint8], float]:
    return make_impression(master, number, preset, sensor).image, sensor.dpi


@click.command(cls=Command)
@click.option("--into", type=PATH, default=WEIGHTS_FILE, help="File to write.")
@click.option("--fingers", default=FINGERS, show_default=True, help="Synthetic fingers.")
@workers
def command(into: Path, fingers: int, workers: int | None) -> None:
    """Train the weights of the quality of prints on synthetic fingers.

    Every finger is pressed with care and then badly. Quality predicts the similarity of the bad
    impressions to the good ones. The same package writes the same file.
    """
    into.parent.mkdir(parents=True, exist_ok=True)
    check_writable(into)
    with ProcessPoolExecutor(workers, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        made = list(pool.map(partial(examples_of_finger, SEED), range(1, fingers + 1)))
    measures = [one for of_finger, _ in made for one in of_finger]
    shares = [one for _, of_finger in made for one in of_finger]
    provenance = {"command": "python -m research train quality", "seed": SEED, "fingers": fingers}
    weights = fit_quality(measures, shares)
    origin = {**provenance, "prints": len(shares), "fpmatch": __version__}
    atomic_write_bytes(into, weights_as_json(weights, origin).encode(), public=True)
    scores = quality_score(np.array([quality_features(one) for one in measures]), weights)
    correlation = np.corrcoef(scores, shares)[0, 1]
    click.echo(f"{into}: {len(shares)} prints; correlation with their similarity to good prints")
    click.echo(f"of their fingers: {correlation:.2f}")
