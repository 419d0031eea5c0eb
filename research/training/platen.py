"""Variation of what a sensor shows besides the print."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from fpmatch.lab.synthesis.sensor import Sensor


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
