"""The skin of one finger in detail: what all its impressions share besides its ridges."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.synthesis.lines import draw_lines
from fpmatch.synthesis.master import NO_IMPRESSION
from fpmatch.synthesis.noise import smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.synthesis.master import Master

    Field = NDArray[np.float32]  # a value a pixel


class _Purpose(IntEnum):
    """Purposes of random streams; those of the master come before these."""

    TEXTURE = 21
    PORES = 22
    CREASES = 23


@dataclass(frozen=True, slots=True)
class SkinParameters:
    """Set texture, pores and creases; lengths are pixels, heights those of the relief."""

    texture: float = 0.18  # standard deviation of the height of rough ridges
    texture_extent_px: float = 1.6
    pore_depth: float = 0.9
    pore_radius_px: float = 0.9  # standard deviation of a pore's profile
    pore_spacing_px: int = 9  # least distance of two pores
    pore_floor: float = 0.6  # relief above which a ridge has pores
    mean_creases: float = 1.2
    max_creases: int = 4


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """Hold the skin of one finger, in pixels of its master, (H, W).

    Parameters
    ----------
    relief : ndarray of float32
        Ridges with their roughness and pores: about -1 in the valleys to 1 on the ridges.
    creases : ndarray of float32
        0 to 1: where a crease keeps the skin off every sensor.
    """

    relief: Field = field(repr=False)
    creases: Field = field(repr=False)


BROKEN_EXTENT_PX: Final = 5.0  # over which the depth of a crease varies


def skin_of(master: Master, parameters: SkinParameters | None = None) -> Skin:
    """Return the skin of a finger, the same for every impression of it."""
    p = parameters or SkinParameters()
    texture, pores, creases = (
        np.random.default_rng([master.seed, master.finger, NO_IMPRESSION, purpose])
        for purpose in _Purpose
    )
    shape = master.relief.shape
    roughness = p.texture * smooth_noise(shape, p.texture_extent_px, texture)
    relief = master.relief + roughness.astype(np.float32) - draw_pores(master.relief, pores, p)
    count = min(int(creases.poisson(p.mean_creases)), p.max_creases)
    return Skin(relief, draw_lines(shape, count, creases, broken_extent_px=BROKEN_EXTENT_PX))


def draw_pores(relief: Field, rng: np.random.Generator, parameters: SkinParameters) -> Field:
    """Return the depth of the pores, (H, W): pits along the crests of the ridges."""
    import cv2  # noqa: PLC0415

    p = parameters
    chance = rng.random(relief.shape, np.float32)
    chance[relief < p.pore_floor] = 0
    around = cv2.dilate(chance, np.ones((p.pore_spacing_px, p.pore_spacing_px), np.uint8))
    pores = ((chance > 0) & (chance >= around)).astype(np.float32)
    depth = cv2.GaussianBlur(pores, (0, 0), p.pore_radius_px)
    return np.asarray(p.pore_depth * 2 * np.pi * p.pore_radius_px**2 * depth, np.float32)
