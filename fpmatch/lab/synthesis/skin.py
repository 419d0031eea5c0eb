"""The skin of one finger in detail: what all its impressions share besides its ridges.

Scratches of one impression are lines as creases are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.lab.synthesis.noise import NO_IMPRESSION, random_streams, smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.master import Master

    Field = NDArray[np.float32]  # a value a pixel

# Lengths are pixels, heights those of the relief.
TEXTURE, TEXTURE_EXTENT_PX = 0.18, 1.6  # standard deviation of the height of rough ridges
PORE_DEPTH, PORE_RADIUS_PX = 0.9, 0.9  # the radius is the standard deviation of the profile
PORE_SPACING_PX: Final = 9  # least distance of two pores
PORE_FLOOR: Final = 0.6  # relief above which a ridge has pores
MEAN_CREASES, MOST_CREASES = 1.2, 4
BROKEN_EXTENT_PX: Final = 5.0  # over which the depth of a crease varies

LINE_STEP_PX: Final = 8.0
LINE_STEPS: Final = (4, 17)  # least, and one more than most
LINE_TILT: Final = 0.7  # largest angle to the horizontal, radians
LINE_BEND: Final = 0.06  # standard deviation of the turn at a step, radians
LINE_WIDTHS_PX: Final = (1, 1, 2, 2, 3, 4)
LINE_START: Final = (0.2, 0.8)  # in shares of the sides
LINE_DEPTH: Final = (0.7, 1.3)


class Skin(NamedTuple):
    """The skin of one finger, in pixels of its master, (H, W)."""

    relief: Field  # with roughness and pores: -1 in the valleys to about 1 on the ridges
    creases: Field  # 0 to 1: where a crease keeps the skin off every sensor


def skin_of(master: Master) -> Skin:
    """Return the skin of a finger, the same for every impression of it."""
    streams = random_streams(master.seed, master.finger, NO_IMPRESSION, range(21, 24))
    texture, pores, creases = streams
    shape = master.relief.shape
    roughness = TEXTURE * smooth_noise(shape, TEXTURE_EXTENT_PX, texture)
    relief = master.relief + roughness.astype(np.float32) - draw_pores(master.relief, pores)
    count = min(int(creases.poisson(MEAN_CREASES)), MOST_CREASES)
    return Skin(relief, draw_lines(shape, count, creases, BROKEN_EXTENT_PX))


def draw_pores(relief: Field, rng: np.random.Generator) -> Field:
    """Return the depth of the pores, (H, W): pits along the crests of the ridges."""
    import cv2  # noqa: PLC0415

    chance = rng.random(relief.shape, np.float32)
    chance[relief < PORE_FLOOR] = 0
    around = cv2.dilate(chance, np.ones((PORE_SPACING_PX, PORE_SPACING_PX), np.uint8))
    pores = ((chance > 0) & (chance >= around)).astype(np.float32)
    depth = cv2.GaussianBlur(pores, (0, 0), PORE_RADIUS_PX)
    return np.asarray(PORE_DEPTH * 2 * np.pi * PORE_RADIUS_PX**2 * depth, np.float32)


def draw_lines(
    shape: tuple[int, int], count: int, rng: np.random.Generator, broken_extent_px: float = 4.0
) -> NDArray[np.float32]:
    """Draw `count` thin, slightly bent, tapering, broken lines: 0 beside them to 1 in them.

    `broken_extent_px` is the length over which their depth varies.
    """
    import cv2  # noqa: PLC0415

    lines = np.zeros(shape, np.float32)
    if not count:
        return lines
    for _ in range(count):
        steps = int(rng.integers(*LINE_STEPS))
        heading = rng.uniform(-LINE_TILT, LINE_TILT) + rng.choice((0, np.pi))
        headings = heading + np.cumsum(rng.normal(scale=LINE_BEND, size=steps))
        moves = LINE_STEP_PX * np.column_stack([np.cos(headings), np.sin(headings)])
        start = rng.uniform(*LINE_START, 2) * np.array(shape[::-1])
        path = np.rint(start + np.cumsum(moves, axis=0)).astype(int).tolist()
        width = int(rng.choice(LINE_WIDTHS_PX))
        taper = np.sin(np.linspace(0.3, np.pi - 0.3, steps))
        depths = (taper * rng.uniform(*LINE_DEPTH, steps)).tolist()
        for begin, end, depth in zip(path, path[1:], depths, strict=False):
            cv2.line(lines, begin, end, depth, width)
    broken = 0.75 + 0.35 * smooth_noise(shape, broken_extent_px, rng)
    soft = cv2.GaussianBlur(lines, (0, 0), 1.0)
    return np.asarray(np.clip(soft * broken, 0, 1), np.float32)
