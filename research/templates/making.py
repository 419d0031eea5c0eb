"""Templates of synthetic fingers by the million, made without drawing images."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.lab.synthesis.database import Plan
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import DEFAULT_SENSOR, SENSORS
from research.templates.fingers import draw_fingers
from research.templates.impressions import draw_impressions

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from fpmatch.lab.synthesis.sensor import Sensor
    from fpmatch.templates.minutiae import Template

AT_ONCE: Final = 64  # fingers


def make_templates(
    seed: int,
    fingers: Iterable[int],
    impressions: int = 1,
    *,
    preset: str = "normal",
    sensors: Sequence[str] = (DEFAULT_SENSOR,),
) -> Iterator[Template]:
    """Make the templates of synthetic fingers without drawing images.

    Pattern, ridges, placement, distortion and pressure are drawn from the same distributions as for
    images (`fpmatch.lab.synthesis.database`), on a lattice of 10 pixels; minutiae are missed, added
    and displaced as extraction does. The numbers of a finger depend on nothing but the seed, its
    number and the impression's. `seed`: family of fingers, 0 to 2**63 - 1. `fingers`: their
    numbers, from 0. `impressions`: of each finger. `preset`, `sensors`: their names; sensors take
    the impressions in turn. The result is finger by finger, the impressions of each in order.

    Examples
    --------
    >>> first, second = make_templates(seed=7, fingers=[1], impressions=2)
    >>> len(first) > 10 and len(second) > 10
    True
    """
    plan = Plan(seed, PRESETS[preset], tuple(SENSORS[name] for name in sensors), impressions)
    numbers = range(1, impressions + 1)
    turns: dict[Sensor, list[int]] = {}
    for m in numbers:
        turns.setdefault(plan.sensor_of(m), []).append(m)
    rest = iter(fingers)
    while chunk := list(islice(rest, AT_ONCE)):
        batch = draw_fingers(plan.seed, np.array(chunk, np.uint64), plan.master)
        taken = {
            sensor: draw_impressions(plan, batch, np.array(turn, np.uint64), sensor)
            for sensor, turn in turns.items()
        }
        for _ in chunk:
            yield from (next(taken[plan.sensor_of(m)]) for m in numbers)
