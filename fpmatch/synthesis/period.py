"""The ridge period of a master print."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.synthesis.noise import smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.synthesis.classes import Range

PERIOD_LEVELS: Final = 64
"""Periods are whole multiples of a pixel over this, so that rounding differs on no machine."""


@dataclass(frozen=True, slots=True)
class PeriodParameters:
    """Set the ridge period; lengths are pixels at 500 dpi."""

    mean_px: float = 8.5
    between_fingers_px: float = 0.55  # standard deviation of a finger's mean
    mean_range_px: Range = (7.4, 10.0)
    tip_share: float = -0.05  # width at the tip relative to the mean
    joint_share: float = 0.10  # and at the joint
    variation_share: float = 0.07  # standard deviation within a finger
    variation_extent_px: float = 32.0
    max_deviations: float = 2.0


def ridge_period(
    shape: tuple[int, int], rng: np.random.Generator, parameters: PeriodParameters | None = None
) -> NDArray[np.float32]:
    """Draw the ridge period map (rows, columns) of a finger in pixels, wider towards the joint."""
    p = parameters or PeriodParameters()
    drawn = p.mean_px + p.between_fingers_px * rng.standard_normal()
    mean = float(np.clip(drawn, *p.mean_range_px))
    noise = smooth_noise(shape, p.variation_extent_px, rng)
    towards_joint = np.linspace(p.tip_share, p.joint_share, shape[0])[:, None]
    varied = p.variation_share * np.clip(noise, -p.max_deviations, p.max_deviations)
    period = mean * (1 + towards_joint + varied)
    return np.asarray(np.rint(period * PERIOD_LEVELS) / PERIOD_LEVELS, np.float32)
