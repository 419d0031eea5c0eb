"""Ridges around cores and deltas: the zero-pole model with piecewise-linear correction.

References
----------
Sherlock, Monro, "A model for interpreting fingerprint topology", Pattern Recognition 26 (1993):
the orientation turns by half the argument around every core and back around every delta.
Vizcaya, Gerhardt, "A nonlinear orientation model for global description of fingerprints",
Pattern Recognition 29 (1996): each argument passes through a piecewise-linear function first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.synthesis.classes import Range

_UP: Final = math.pi / 2


@dataclass(frozen=True, slots=True)
class ZeroPoleParameters:
    """Set the deviation of the arguments from the plain model."""

    corner_count: int = 8  # of each piecewise-linear correction
    correction_deg: float = 7.0  # standard deviation at a corner, of any correction
    uprightness: Range = (0.3, 0.8)  # rotation of a loop's axis to the vertical by its delta
    loop_narrowing_deg: Range = (16.0, 44.0)  # inclination of a core's flanks towards its axis


@dataclass(frozen=True, slots=True)
class _Turn:
    """One singular point, and the share of its corrected argument by which ridges turn."""

    place: complex
    share: float
    correction: NDArray[np.float64]  # of the argument, at corners evenly spaced around the point

    def around(self, place: NDArray[np.complex128]) -> NDArray[np.float64]:
        argument = np.angle(place - self.place)
        values = np.append(self.correction, self.correction[0])
        corners = np.linspace(0, 2 * np.pi, values.size)
        bent = argument + np.interp(np.mod(argument, 2 * np.pi), corners, values)
        return np.asarray(self.share * bent, np.float64)


def zero_pole_turning(
    place: NDArray[np.complex128],
    cores: list[complex],
    deltas: list[complex],
    rng: np.random.Generator,
    parameters: ZeroPoleParameters | None = None,
) -> NDArray[np.float64]:
    """Draw the rotation of ridges from the horizontal by the singular points, (H, W).

    Radians, counter-clockwise, modulo π. Points and `place` (H, W) are x + iy, y up. Besides random
    corrections, deltas are bent so that loops are more upright than in the plain model, and cores
    so that the two legs of a loop are nearly parallel.
    """
    p = parameters or ZeroPoleParameters()
    corners = np.arange(p.corner_count) * (2 * np.pi / p.corner_count)
    jitter = math.radians(p.correction_deg) * rng.standard_normal((10, p.corner_count))
    uprightness = rng.uniform(*p.uprightness)
    narrowing = math.radians(rng.uniform(*p.loop_narrowing_deg))
    turns = [_Turn(core, 0.5, bend) for core, bend in zip(cores, jitter, strict=False)]
    for delta, bend in zip(deltas, jitter[len(cores) :], strict=False):
        to_cores = float(np.angle(sum(cores) / len(cores) - delta)) if cores else _UP
        lean = uprightness * (to_cores - _UP) * np.clip(np.cos(corners - to_cores), 0, 1)
        turns.append(_Turn(delta, -0.5, bend - lean))
    total = np.zeros(place.shape)
    for turn in turns:
        narrowed = turn
        if turn.share > 0:
            here = np.array([turn.place])
            opening = 2 * sum(float(o.around(here)[0]) for o in turns if o is not turn)
            closer = narrowing * np.sin(corners - opening)
            narrowed = replace(turn, correction=turn.correction - closer)
        total += narrowed.around(place)
    return total
