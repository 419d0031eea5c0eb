"""Smudges: skin that moved while it touched, and residue of earlier fingers on the glass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.synthesis.noise import smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.synthesis.classes import Range

    Field = NDArray[np.float32]  # a value a pixel


@dataclass(frozen=True, slots=True)
class SmearParameters:
    """Set how often and how far skin moves; lengths in pixels at 500 dpi."""

    chance: float = 0.1  # probability of a smear in an impression
    length_px: Range = (5.0, 11.0)
    share: Range = (0.03, 0.12)  # approximate share of the print
    extent_px: float = 45.0
    stain: Range = (0.0, 0.1)  # largest share of ink between ridges by damp
    stain_extent_px: float = 35.0


def stain(
    touching: NDArray[np.floating],
    rng: np.random.Generator,
    parameters: SmearParameters | None = None,
    *,
    px: float = 1.0,
) -> Field:
    """Return the share of ink that damp and grease leave between the ridges, (h, w).

    `touching` is 1 where the finger touches; `px` is the number of image pixels for one at 500 dpi.
    """
    p = parameters or SmearParameters()
    darkest = rng.uniform(*p.stain)
    shape = (touching.shape[0], touching.shape[1])
    patches = np.clip(smooth_noise(shape, p.stain_extent_px * px, rng), 0, 2) / 2
    return np.asarray(darkest * patches * touching, np.float32)


def smear(
    relief: Field,
    rng: np.random.Generator,
    parameters: SmearParameters | None = None,
    *,
    px: float = 1.0,
) -> tuple[Field, Field]:
    """Blur the skin (h, w) in patches along one direction, as if it had moved there.

    Returns the relief, and the share of the blur: 0 where it is unchanged, 1 in the middle of a
    patch.
    """
    import cv2  # noqa: PLC0415

    p = parameters or SmearParameters()
    if rng.random() >= p.chance:
        return relief, np.zeros_like(relief)
    angle = rng.uniform(0, np.pi)
    length = rng.uniform(*p.length_px) * px
    reach = int(np.ceil(length / 2))
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    half = length / 2 * np.array([np.cos(angle), np.sin(angle)])
    begin, end = (np.rint(reach + sign * half).astype(int).tolist() for sign in (-1, 1))
    cv2.line(kernel, begin, end, 1.0, 1)
    moved = cv2.filter2D(relief, -1, kernel / kernel.sum())
    patches = smooth_noise((relief.shape[0], relief.shape[1]), p.extent_px * px, rng)
    limit = np.quantile(patches, 1 - rng.uniform(*p.share))
    share = np.clip(2.5 * (patches - limit), 0, 1).astype(np.float32)
    return np.asarray(relief + share * (moved - relief), np.float32), share
