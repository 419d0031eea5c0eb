"""Genuine scores by the elastic distortion between two prints, which synthesis knows exactly.

Fingers are pressed on a sensor with care, so that the impressions differ in the distortion of the
skin alone. Each genuine pair has a known map from print to print; its deviation from the nearest
similarity transform is the distortion. It is measured as displacement, and as strain, the share by
which the skin is stretched or compressed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.gallery.engine.workers import run_chunks
from fpmatch.image.extract import extract
from fpmatch.lab.evaluation.rates.error_rates import threshold_at_fmr
from fpmatch.lab.synthesis.contact import outline_radius
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import make_master
from fpmatch.lab.synthesis.plan import plain_sensor
from fpmatch.lab.synthesis.presets import preset_named
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.registry import DEFAULT_MATCHER
from fpmatch.matching.verify import DEFAULT_THRESHOLD
from fpmatch.pointset.geometry.similarity import Similarity
from research.all_pairs import compare_all_pairs
from research.databases import without_ridges

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.impression import Impression
    from fpmatch.lab.synthesis.master import Master
    from fpmatch.lab.synthesis.presets import Preset
    from fpmatch.lab.synthesis.sensor import Sensor
    from fpmatch.templates.minutiae import Template

FIRST_FINGER: Final = 1
CONDITIONS: Final = {
    "whole print, 388 × 374 px": SENSORS["optical-388x374"],
    "partial print, 160 × 160 px": plain_sensor(160, 160),
}
"""The sensors that the fingers are pressed on, and what the prints are called."""
FITTED_EVERY_PX: Final = 3  # step between the pixels that the similarity is fitted to
PERCENTILE: Final = 95.0  # of the strain over the skin in both prints
FMR: Final = 0.001  # at which FNMR is measured, on the impostor pairs of the same prints
KINDS: Final = ("ridges", "minutiae")
"""Templates as they are extracted, and without their ridge field."""


@dataclass(frozen=True, slots=True)
class DistortionParameters:
    """Set the prints and the classes of strain; lengths in pixels at 500 dpi.

    `fingers`, `impressions`: numbers of prints: the first two impressions of a finger are not
    distorted, the last most. `max_torsion_deg`, `max_traction_px`: turn and drag of the finger over
    the sensor in the last impression; proportionally less in the others. In the contacts of the
    preset "clean" the skin just does not fold.
    """

    fingers: int = 24
    impressions: int = 12
    seed: int = 17  # of the fingers
    max_torsion_deg: float = 10.0
    max_traction_px: float = 24.0
    grid_px: int = 12  # step of the grid on which strain and displacement are measured
    limits: tuple[float, ...] = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4)  # strains between the classes
    min_pairs: int = 20  # least number of genuine pairs in a class that is reported


@dataclass(frozen=True, slots=True, eq=False)
class PressedFinger:
    """The prints of one finger on one sensor.

    `templates`: one an impression. `strain`, `displacement_px` (K,): of each pair of impressions,
    in the order of ``numpy.triu_indices``.
    """

    templates: list[Template]
    strain: NDArray[np.float64]
    displacement_px: NDArray[np.float64]


def distorted(preset: Preset, share: float, parameters: DistortionParameters) -> Preset:
    """Return a preset whose impressions all have one share of the largest distortion."""
    torsion = share * parameters.max_torsion_deg
    traction = share * parameters.max_traction_px
    placement = replace(
        preset.placement, torsion_deg=(torsion, torsion), traction=(traction, traction)
    )
    return replace(preset, placement=placement)


def distortion_between(
    probe: Impression, reference: Impression, grid_px: int = 12
) -> tuple[float, float]:
    """Return how far the map from one impression to another is from the nearest similarity.

    These are the 95th percentile, over the skin in both prints, of the larger principal strain, and
    the largest distance between a point and its place under that similarity, in pixels of the
    reference. Raises a `DatasetError` if the two share too little skin.
    """
    points, there, inside = _skin_in_both(probe, reference, grid_px)
    # central differences, where the neighbours on the grid are shared as well
    whole = inside[1:-1, 1:-1] & inside[1:-1, :-2] & inside[1:-1, 2:]
    whole &= inside[:-2, 1:-1] & inside[2:, 1:-1]
    if not whole.any():
        raise DatasetError("the two impressions share too little skin to measure its distortion")
    nearest = true_transform(probe, reference)
    off = np.hypot(*(there[inside] - nearest.apply(points[inside])).T)
    along_x = (there[1:-1, 2:] - there[1:-1, :-2]) / (2 * grid_px)
    along_y = (there[2:, 1:-1] - there[:-2, 1:-1]) / (2 * grid_px)
    jacobian = np.stack([along_x, along_y], axis=-1)[whole] / nearest.scale
    stretch = np.linalg.svd(jacobian, compute_uv=False)
    strain = np.abs(stretch - 1).max(axis=1)
    return float(np.percentile(strain, PERCENTILE)), float(off.max())


def true_transform(probe: Impression, reference: Impression) -> Similarity:
    """Return the similarity nearest to the true map between impressions, over common skin."""
    points, there, shared = _skin_in_both(probe, reference, FITTED_EVERY_PX)
    return Similarity.fit(points[shared], there[shared])


def _skin_in_both(
    probe: Impression, reference: Impression, every_px: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return pixels of the probe (H, W, 2), their places in the reference, and which both show."""
    rows, columns = probe.image.shape
    y, x = np.mgrid[0:rows:every_px, 0:columns:every_px]
    points = np.stack([x, y], axis=-1).astype(np.float64)
    flat = points.reshape(-1, 2)
    there = reference.warp.from_master(probe.warp.to_master(flat))
    last = (reference.image.shape[1] - 1, reference.image.shape[0] - 1)
    shared = ((there >= 0) & (there <= last)).all(axis=1)
    shared &= outline_radius(probe.warp.upright(flat)) < 1
    shared &= outline_radius(reference.warp.upright(there)) < 1
    return points, there.reshape(points.shape), shared.reshape(x.shape)


def press_finger(parameters: DistortionParameters, finger: int) -> list[PressedFinger]:
    """Make the impressions of a finger on each sensor, extract them, measure their distortion."""
    master = make_master(parameters.seed, finger)
    return [_pressed_on(master, sensor, parameters) for sensor in CONDITIONS.values()]


def _pressed_on(master: Master, sensor: Sensor, parameters: DistortionParameters) -> PressedFinger:
    made = []
    for number in range(1, parameters.impressions + 1):
        share = max(0, number - 2) / max(1, parameters.impressions - 2)
        preset = distorted(preset_named("clean"), share, parameters)
        made.append(make_impression(master, number, preset, sensor))
    found = [
        distortion_between(made[i], made[j], parameters.grid_px)
        for i, j in zip(*np.triu_indices(len(made), 1), strict=True)
    ]
    strain, displacement = np.array(found).reshape(-1, 2).T
    templates = [extract(impression.image, dpi=impression.dpi) for impression in made]
    return PressedFinger(templates, strain, displacement)


def measure_distortion(
    parameters: DistortionParameters | None = None, *, workers: int | None = None
) -> dict[str, Any]:
    """Return scores and error rates of the default matcher by classes of strain, as JSON values."""
    p = parameters or DistortionParameters()
    numbers = list(range(FIRST_FINGER, FIRST_FINGER + p.fingers))
    fingers = run_chunks(press_finger, p, numbers, workers=workers)
    conditions = [
        {"name": name, **_measured([finger[k] for finger in fingers], p, workers)}
        for k, name in enumerate(CONDITIONS)
    ]
    return {
        "fingers": p.fingers,
        "impressions": p.impressions,
        "seed": p.seed,
        "max_torsion_deg": p.max_torsion_deg,
        "max_traction_px": p.max_traction_px,
        "conditions": conditions,
    }


def _measured(
    fingers: Sequence[PressedFinger], p: DistortionParameters, workers: int | None
) -> dict[str, Any]:
    """Compare all prints of one condition, and summarise the genuine pairs by their strain."""
    templates = [template for finger in fingers for template in finger.templates]
    bare = [without_ridges(template) for template in templates]
    whose = np.repeat(np.arange(p.fingers), p.impressions)
    probe, reference = np.triu_indices(len(templates), 1)
    genuine = whose[probe] == whose[reference]
    kinds = {}
    for kind, compared in zip(KINDS, (templates, bare), strict=True):
        similarity = compare_all_pairs(compared, workers=workers)
        kinds[kind] = _Scores.of(similarity[genuine], similarity[~genuine])
    # the genuine pairs come in the order in which the distortions of each finger were measured
    strain = np.concatenate([finger.strain for finger in fingers])
    displacement = np.concatenate([finger.displacement_px for finger in fingers])
    classes = []
    for low, high in zip((0.0, *p.limits), (*p.limits, math.inf), strict=True):
        chosen = (strain >= low) & (strain < high)
        if chosen.sum() >= p.min_pairs:
            classes.append(
                {
                    "from": low,
                    "to": None if math.isinf(high) else high,
                    "pairs": int(chosen.sum()),
                    "strain": _rounded(np.median(strain[chosen])),
                    "displacement_px": _rounded(np.median(displacement[chosen])),
                    **{kind: scores.summary(chosen) for kind, scores in kinds.items()},
                }
            )
    return {
        "genuine": int(genuine.sum()),
        "impostor": int((~genuine).sum()),
        "minutiae": float(np.median([len(template.minutiae) for template in templates])),
        "classes": classes,
    }


@dataclass(frozen=True, slots=True, eq=False)
class _Scores:
    """The genuine similarities and scores of one kind of template."""

    similarity: NDArray[np.float64]
    score: NDArray[np.float64]
    threshold: float | None

    @classmethod
    def of(cls, genuine: NDArray[np.float64], impostor: NDArray[np.float64]) -> _Scores:
        scores = load_calibration(DEFAULT_MATCHER).scores(genuine)
        return cls(genuine, scores, threshold_at_fmr(impostor, FMR))

    def summary(self, chosen: NDArray[np.bool_]) -> dict[str, float | None]:
        lower, median, upper = np.percentile(self.score[chosen], (25, 50, 75))
        fnmr = None
        if self.threshold is not None:
            fnmr = _rounded((self.similarity[chosen] <= self.threshold).mean())
        return {
            "score": _rounded(median),
            "lower_quartile": _rounded(lower),
            "upper_quartile": _rounded(upper),
            "below_threshold": _rounded((self.score[chosen] < DEFAULT_THRESHOLD).mean()),
            "fnmr": fnmr,
        }


def _rounded(value: float | np.floating[Any]) -> float:
    return round(float(value), 4)
