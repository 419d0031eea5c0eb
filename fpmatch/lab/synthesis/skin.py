"""The skin of one finger in detail: what all its impressions share besides its ridges.

Scratches of one impression are lines as creases are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.lab.synthesis.noise import NO_IMPRESSION, random_streams, smooth_noise

if TYPE_CHECKING:
    from collections.abc import Sequence

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


# Of detailed skin, which differs from finger to finger.
UNDULATION, UNDULATION_EXTENT_PX = (0.1, 0.35), (1.7, 3.0)  # of the height: ridges of uneven width
PORE_SPACE_PX: Final = 7  # least distance of two pores along a ridge
PORE_SHARE: Final = (0.5, 1.0)  # of the places that have one
CREST: Final = 0.93  # relief above which a pore opens
PORE_DEPTHS, PORE_RADII_PX = (0.3, 2.3), (0.7, 1.1)
NOTCH_DEPTHS, NOTCH_RADIUS_PX = (0.1, 0.6), 1.9  # around a pore, by which dry ridges break
INCIPIENT_CHANCE: Final = 0.15  # of a finger
INCIPIENT_FLOOR: Final = -0.8  # relief below which an incipient ridge may rise
INCIPIENT_HEIGHT: Final = (0.6, 1.2)
HAIRLINES: Final = (0.0, 0.0, 4.0, 12.0, 40.0)  # mean number of thin creases of a finger


class Skin(NamedTuple):
    """The skin of one finger, in pixels of its master, (H, W)."""

    relief: Field  # with roughness and pores: -1 in the valleys to about 1 on the ridges
    creases: Field  # 0 to 1: where a crease keeps the skin off every sensor


def detailed_skin(master: Master) -> Skin:
    """Return the skin of a finger with all that a sensor of 500 dpi shows of it.

    Ridges have uneven widths and pores along their crests, valleys of some fingers have incipient
    ridges, and some fingers many thin creases.
    """
    streams = random_streams(master.seed, master.finger, NO_IMPRESSION, range(23, 28))
    creasing, uneven, pitting, rising, lining = streams
    shape = master.relief.shape
    undulation = smooth_noise(shape, uneven.uniform(*UNDULATION_EXTENT_PX), uneven)
    relief = master.relief + np.float32(uneven.uniform(*UNDULATION)) * undulation
    relief = relief - _pits(master.relief, pitting)
    if rising.random() < INCIPIENT_CHANCE:
        relief = relief + _incipient(master.relief, rising)
    count = min(int(creasing.poisson(MEAN_CREASES)), MOST_CREASES)
    creases = draw_lines(shape, count, creasing, BROKEN_EXTENT_PX)
    thin = lining.poisson(lining.choice(HAIRLINES))
    family = lining.uniform(0, np.pi)
    hair = draw_lines(shape, int(thin), lining, BROKEN_EXTENT_PX, widths=(1,), heading=family)
    return Skin(np.asarray(relief, np.float32), np.maximum(creases, hair))


def _pits(relief: Field, rng: np.random.Generator) -> Field:
    """Return the depth of pores and of the notches around them, (H, W)."""
    import cv2  # noqa: PLC0415

    pores = _pore_places(relief, CREST, PORE_SPACE_PX, rng)
    pores *= rng.random(relief.shape, np.float32) < rng.uniform(*PORE_SHARE)
    pores *= rng.uniform(0.4, 1.3, relief.shape).astype(np.float32)
    depth = np.zeros_like(relief)
    radius = rng.uniform(*PORE_RADII_PX)
    for sigma, deep in ((radius, PORE_DEPTHS), (NOTCH_RADIUS_PX, NOTCH_DEPTHS)):
        profile = cv2.GaussianBlur(pores, (0, 0), sigma)
        depth += np.float32(rng.uniform(*deep) * 2 * np.pi * sigma**2) * profile
    return depth


def _incipient(relief: Field, rng: np.random.Generator) -> Field:
    """Return the height of incipient ridges, (H, W): thin, broken, in the middle of valleys."""
    low = np.clip((INCIPIENT_FLOOR - relief) / (1 + INCIPIENT_FLOOR), 0, 1)
    patches = np.clip(0.5 + smooth_noise(relief.shape, 45.0, rng), 0, 1)
    broken = np.clip(0.7 + 0.8 * smooth_noise(relief.shape, 4.0, rng), 0, 1)
    return np.asarray(rng.uniform(*INCIPIENT_HEIGHT) * low * patches * broken, np.float32)


def skin_of(master: Master) -> Skin:
    """Return the skin of a finger, the same for every impression of it."""
    streams = random_streams(master.seed, master.finger, NO_IMPRESSION, range(21, 24))
    import cv2  # noqa: PLC0415

    texture, pitting, creases = streams
    shape = master.relief.shape
    roughness = TEXTURE * smooth_noise(shape, TEXTURE_EXTENT_PX, texture)
    places = _pore_places(master.relief, PORE_FLOOR, PORE_SPACING_PX, pitting)
    profile = cv2.GaussianBlur(places, (0, 0), PORE_RADIUS_PX)
    pores = np.asarray(PORE_DEPTH * 2 * np.pi * PORE_RADIUS_PX**2 * profile, np.float32)
    relief = master.relief + roughness.astype(np.float32) - pores
    count = min(int(creases.poisson(MEAN_CREASES)), MOST_CREASES)
    return Skin(relief, draw_lines(shape, count, creases, BROKEN_EXTENT_PX))


def _pore_places(relief: Field, floor: float, window_px: int, rng: np.random.Generator) -> Field:
    """Return 1 at pores: the first of random pixels of high relief in a window around them."""
    import cv2  # noqa: PLC0415

    chance = rng.random(relief.shape, np.float32)
    chance[relief < floor] = 0
    around = cv2.dilate(chance, np.ones((window_px, window_px), np.uint8))
    return np.asarray((chance > 0) & (chance >= around), np.float32)


def draw_lines(
    shape: tuple[int, int],
    count: int,
    rng: np.random.Generator,
    broken_extent_px: float = 4.0,
    *,
    widths: Sequence[int] = LINE_WIDTHS_PX,
    heading: float = 0.0,
) -> NDArray[np.float32]:
    """Draw `count` thin, slightly bent, tapering, broken lines: 0 beside them to 1 in them.

    `broken_extent_px` is the length over which their depth varies, `heading` their usual angle.
    """
    import cv2  # noqa: PLC0415

    lines = np.zeros(shape, np.float32)
    if not count:
        return lines
    for _ in range(count):
        steps = int(rng.integers(*LINE_STEPS))
        ahead = heading + rng.uniform(-LINE_TILT, LINE_TILT) + rng.choice((0, np.pi))
        headings = ahead + np.cumsum(rng.normal(scale=LINE_BEND, size=steps))
        moves = LINE_STEP_PX * np.column_stack([np.cos(headings), np.sin(headings)])
        start = rng.uniform(*LINE_START, 2) * np.array(shape[::-1])
        path = np.rint(start + np.cumsum(moves, axis=0)).astype(int).tolist()
        width = int(rng.choice(widths))
        taper = np.sin(np.linspace(0.3, np.pi - 0.3, steps))
        depths = (taper * rng.uniform(*LINE_DEPTH, steps)).tolist()
        for begin, end, depth in zip(path, path[1:], depths, strict=False):
            cv2.line(lines, begin, end, depth, width)
    broken = 0.75 + 0.35 * smooth_noise(shape, broken_extent_px, rng)
    soft = cv2.GaussianBlur(lines, (0, 0), 1.0)
    return np.asarray(np.clip(soft * broken, 0, 1), np.float32)
