"""The silhouette of a master print: all skin that a sensor may touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.synthesis.classes import Range


@dataclass(frozen=True, slots=True)
class SilhouetteParameters:
    """Set the outline: a round tip above straight sides above a flatter foot; shares of the print.

    Heights are shares of the rows, widths of the columns.
    """

    half_width: Range = (0.40, 0.47)  # at the widest
    tip_height: Range = (0.40, 0.46)  # from the widest row to the tip
    foot_height: Range = (0.40, 0.47)  # and to the joint
    tip_exponent: Range = (2.0, 2.3)  # of the superellipse: 2 is round, more is squarer
    foot_exponent: Range = (2.8, 4.5)
    off_middle: Range = (-0.01, 0.01)


def fingertip_silhouette(
    shape: tuple[int, int], rng: np.random.Generator, parameters: SilhouetteParameters | None = None
) -> NDArray[np.bool_]:
    """Draw the outline of one fingertip; return its inside, (rows, columns)."""
    p = parameters or SilhouetteParameters()
    rows, columns = shape
    half_width = rng.uniform(*p.half_width) * columns
    tip, foot = rng.uniform(*p.tip_height) * rows, rng.uniform(*p.foot_height) * rows
    tip_exponent, foot_exponent = rng.uniform(*p.tip_exponent), rng.uniform(*p.foot_exponent)
    middle = (0.5 + rng.uniform(*p.off_middle)) * columns
    up = rows / 2 - np.arange(rows)[:, None]
    across = np.abs(np.arange(columns)[None] - middle) / half_width
    on_tip = across**tip_exponent + (np.clip(up, 0, None) / tip) ** tip_exponent <= 1
    on_foot = across**foot_exponent + (np.clip(-up, 0, None) / foot) ** foot_exponent <= 1
    return np.asarray(np.where(up >= 0, on_tip, on_foot), np.bool_)
