"""Templates of synthetic fingers by the million, made without drawing images."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.lab.synthesis.plan import DEFAULT_SENSOR, MOST_IMPRESSIONS, Plan, sensors_named
from fpmatch.lab.synthesis.template_fingers import draw_fingers
from fpmatch.lab.synthesis.template_impressions import draw_impressions

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from fpmatch.lab.synthesis.presets import Preset
    from fpmatch.lab.synthesis.sensor import Sensor
    from fpmatch.templates.minutiae import Template

LARGEST_FINGER: Final = 2**53
_AT_ONCE: Final = 32  # fingers


def make_templates(
    seed: int,
    fingers: Iterable[int],
    impressions: int = 1,
    *,
    first_impression: int = 1,
    preset: str | Preset = "normal",
    sensors: Sequence[str | Sensor] = (DEFAULT_SENSOR,),
) -> Iterator[Template]:
    """Make the templates of synthetic fingers without drawing images.

    Pattern, ridges, placement, distortion and pressure are drawn from the same distributions as for
    images (`fpmatch.lab.synthesis.database`), on a lattice of 8 pixels; minutiae are missed, added
    and displaced as extraction does. The numbers of a finger depend on nothing but the seed, its
    number and the impression's, so that any part of a gallery can be made alone. `seed`: family of
    fingers, 0 to 2**63 - 1. `fingers`: numbers of the fingers, 0 to 2**53. `impressions`: how many
    templates of each finger, 1 to 1000. `first_impression`: number of the first of them, from 1.
    `preset`: ``"clean"``, ``"easy"``, ``"normal"``, ``"hard"``, ``"stretched"`` or ``"rolled"``.
    `sensors`: what would have taken the images, in turn: their sizes and resolutions. The result is
    finger by finger, the impressions of each in order. Raises a `DatasetError` if a number is out
    of its range, or there is no such sensor; an `ImageError` if there is no such preset.

    Examples
    --------
    >>> from fpmatch.lab.synthesis.templates import make_templates
    >>> first, second = make_templates(seed=7, fingers=[1], impressions=2)
    >>> len(first) > 10 and len(second) > 10
    True
    """
    plan = Plan(seed, preset, sensors_named(sensors), MOST_IMPRESSIONS)
    last = first_impression + impressions - 1
    if not (impressions >= 1 and 1 <= first_impression <= last <= MOST_IMPRESSIONS):
        raise DatasetError(
            f"{impressions} impressions from number {first_impression}: there must be at least 1, "
            f"numbered within 1 to {MOST_IMPRESSIONS}"
        )
    return _made(plan, iter(fingers), range(first_impression, last + 1))


def _made(plan: Plan, fingers: Iterator[int], numbers: range) -> Iterator[Template]:
    """Yield the templates of some fingers at once after another."""
    turns: dict[Sensor, list[int]] = {}
    for m in numbers:
        turns.setdefault(plan.sensor_of(m), []).append(m)
    while chunk := list(islice(fingers, _AT_ONCE)):
        wrong = [finger for finger in chunk if not 0 <= finger <= LARGEST_FINGER]
        if wrong:
            raise DatasetError(f"finger {wrong[0]}: must lie between 0 and {LARGEST_FINGER}")
        batch = draw_fingers(plan.seed, np.array(chunk, np.uint64), plan.master)
        taken = {
            sensor: draw_impressions(plan, batch, np.array(turn, np.uint64), sensor)
            for sensor, turn in turns.items()
        }
        for _ in chunk:
            yield from (next(taken[plan.sensor_of(m)]) for m in numbers)
