"""Templates of synthetic fingers by the million, made without drawing images."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.synthesis.master import MasterParameters
from fpmatch.synthesis.plan import DEFAULT_SENSOR, LARGEST_SEED, MOST_IMPRESSIONS, sensors_named
from fpmatch.synthesis.presets import preset_named
from fpmatch.synthesis.template_fingers import draw_fingers
from fpmatch.synthesis.template_impressions import draw_impressions

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from fpmatch.minutiae import Template
    from fpmatch.synthesis.presets import Preset
    from fpmatch.synthesis.sensor import Sensor

LARGEST_FINGER: Final = 2**53
_AT_ONCE: Final = 32  # fingers


def make_templates(
    seed: int,
    fingers: Iterable[int],
    impressions: int = 1,
    *,
    first_impression: int = 1,
    preset: str = "normal",
    sensor: str | Sensor = DEFAULT_SENSOR,
) -> Iterator[Template]:
    """Make the templates of synthetic fingers without drawing images.

    Pattern, ridges, placement, distortion and pressure are drawn from the same distributions as for
    images (`fpmatch.synthesis.make_database`), on a lattice of 8 pixels; minutiae are missed, added
    and displaced as extraction does. The numbers of a finger depend on nothing but the seed, its
    number and the impression's, so that any part of a gallery can be made alone.

    Parameters
    ----------
    seed : int
        Family of fingers, 0 to 2**63 - 1.
    fingers : iterable of int
        Numbers of the fingers, 0 to 2**53.
    impressions : int
        How many templates of each finger, 1 to 1000.
    first_impression : int
        Number of the first of them, from 1.
    preset : str
        ``"clean"``, ``"easy"``, ``"normal"``, ``"hard"`` or ``"stretched"``.
    sensor : str or Sensor
        Size and resolution of the image that would have been taken.

    Yields
    ------
    Template
        Finger by finger, the impressions of each in order.

    Raises
    ------
    DatasetError
        If a number is out of its range, or there is no such sensor.
    ImageError
        If there is no such preset.

    Examples
    --------
    >>> first, second = make_templates(seed=7, fingers=[1], impressions=2)
    >>> len(first) > 10 and len(second) > 10
    True
    """
    chosen, (taken_by,) = preset_named(preset), sensors_named([sensor])
    if not 0 <= seed <= LARGEST_SEED:
        raise DatasetError(f"seed {seed}: must lie between 0 and {LARGEST_SEED}")
    last = first_impression + impressions - 1
    if not (impressions >= 1 and 1 <= first_impression <= last <= MOST_IMPRESSIONS):
        raise DatasetError(
            f"{impressions} impressions from number {first_impression}: there must be at least 1, "
            f"numbered within 1 to {MOST_IMPRESSIONS}"
        )
    numbers = np.arange(first_impression, last + 1, dtype=np.uint64)
    return _made(seed, iter(fingers), numbers, chosen, taken_by)


def _made(
    seed: int, fingers: Iterator[int], numbers: NDArray[np.uint64], preset: Preset, sensor: Sensor
) -> Iterator[Template]:
    """Yield the templates of some fingers at once after another."""
    master = MasterParameters()
    while chunk := list(islice(fingers, _AT_ONCE)):
        wrong = [finger for finger in chunk if not 0 <= finger <= LARGEST_FINGER]
        if wrong:
            raise DatasetError(f"finger {wrong[0]}: must lie between 0 and {LARGEST_FINGER}")
        batch = draw_fingers(seed, np.array(chunk, np.uint64), master)
        yield from draw_impressions(seed, batch, numbers, preset, sensor, master.shape)
