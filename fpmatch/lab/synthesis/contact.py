"""Contact of skin and glass: which height of relief prints, where ridges are legible, and smudges.

Smudges are skin that moved while it touched, and residue of earlier fingers on the glass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.lab.synthesis.noise import smooth_noise
from fpmatch.lab.synthesis.skin import draw_lines

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.lab.synthesis.orientation import Range

    Field = NDArray[np.float32]  # a value a pixel

EDGE_START: Final = 0.86  # radius from which the skin lifts off the glass
EDGE_STEEPNESS: Final = 50.0  # relief by which it has lifted at one more radius
OFF_THE_GLASS: Final = 3.0  # relief of skin too deep to touch
WET_SPOT, DRY_SPOT = -0.75, 0.7  # relief by which a spot's threshold differs
SPOT_EXTENT_PX: Final = 9.0  # of the ragged edge of a spot, and half its least radius
TIP_EXPONENT, FOOT_EXPONENT = 2.1, 2.7  # of the superellipse: 2 is round, more is squarer

BEADS: Final = ((1.0, 0.8), (3.5, 0.6))  # octaves: extent, and share of the deviation
MEAN_SQUARE_RADIUS: Final = 0.4  # about its mean over the contact

LEGIBLE: Final = 0.85  # share of the relief beyond which valleys are filled or ridges lost
POINT_SIGMA_PX: Final = 2.5  # Gaussian window at a minutia
AROUND_SIGMA_PX: Final = 5.0  # and around it, about half a ridge period
MOST_MISSING: Final = 0.15  # largest share of the surroundings without legible ridges
BORDER_PX: Final = 7.0  # nothing is legible nearer the image border


@dataclass(frozen=True, slots=True)
class PressureParameters:
    """Set how a finger is pressed; lengths in pixels at 500 dpi, heights in units of the relief."""

    dryness: Range = (-0.15, 0.2)  # height below which nothing prints; negative is wet
    unevenness: float = 0.12  # standard deviation of the dryness over the print
    unevenness_extent_px: float = 40.0
    tilt: Range = (0.0, 0.15)  # extra dryness of one side
    grain: float = 0.2  # roughness of this impression alone
    wear: Range = (0.0, 0.1)  # share of the relief that worn skin lacks
    wear_extent_px: float = 45.0
    creases: float = 1.0  # visible depth of the finger's creases
    max_scratches: int = 1
    max_spots: int = 1  # too wet or too dry
    spot_radius_px: Range = (16.0, 48.0)
    beading: Range = (0.0, 0.0)  # standard deviation of the height along ridges
    beading_extent_px: float = 2.0
    middle: Range = (0.0, 0.0)  # by which the middle is pressed more than the outline
    edge: Range = (1 - EDGE_START, 1 - EDGE_START)  # share of the radius in which the skin lifts
    outline: float = 0.03  # standard deviation of the outline, shares of its radius
    ragged: float = 0.035  # and of its fine raggedness


@dataclass(frozen=True, slots=True)
class SmearParameters:
    """Set how often and how far skin moves; lengths in pixels at 500 dpi."""

    chance: float = 0.1  # probability of a smear in an impression
    length_px: Range = (5.0, 11.0)
    share: Range = (0.03, 0.12)  # approximate share of the print
    extent_px: float = 45.0
    stain: Range = (0.0, 0.1)  # largest share of ink between ridges by damp
    stain_extent_px: float = 35.0


class Contact(NamedTuple):
    """The contact of one finger with the sensor, for each pixel of the image (h, w)."""

    threshold: Field  # height that skin must have to print
    strength: Field  # share of the relief that wear has left
    grain: Field  # roughness to add to the relief


def outline_radius(upright: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the radius of points of a contact, (N, 2) in half axes: 1 on the outline.

    The outline is round at the tip and squarer at the joint, which lies at positive y.
    """
    across, along = np.abs(upright).T
    exponent = np.where(upright[:, 1] > 0, FOOT_EXPONENT, TIP_EXPONENT)
    return np.asarray((across**exponent + along**exponent) ** (1 / exponent))


def press(
    radius: NDArray[np.floating],
    on_print: NDArray[np.floating],
    creases: NDArray[np.floating],
    rng: np.random.Generator,
    p: PressureParameters,
    px: float = 1.0,
) -> Contact:
    """Press a finger on the glass once.

    Of each pixel (h, w), `radius` is 0 in the middle of the contact and 1 on its outline,
    `on_print` is 1 on the skin of the print, falling towards its border, and `creases` is the depth
    of the finger's creases, 0 to 1. `px` is the number of image pixels for one at 500 dpi.
    """
    shape = (radius.shape[0], radius.shape[1])
    dryness = rng.uniform(*p.dryness)
    threshold = dryness + p.unevenness * smooth_noise(shape, px * p.unevenness_extent_px, rng)
    tilt, angle = rng.uniform(*p.tilt), rng.uniform(0, 2 * np.pi)
    y, x = np.linspace(-1, 1, shape[0])[:, None], np.linspace(-1, 1, shape[1])
    threshold += tilt * (np.cos(angle) * x + np.sin(angle) * y)
    for _ in range(int(rng.integers(0, p.max_spots + 1))):
        threshold += _spot(radius, rng.uniform(*p.spot_radius_px) * px, px, rng)
    outline = 1 + p.outline * smooth_noise(shape, 60 * px, rng)
    out = radius * outline + p.ragged * smooth_noise(shape, 5 * px, rng)
    edge = rng.uniform(*p.edge) if p.edge[0] < p.edge[1] else p.edge[0]
    steepness = EDGE_STEEPNESS * ((1 - EDGE_START) / edge) ** 2
    threshold += steepness * np.clip(out - (1 - edge), 0, None) ** 2
    scratches = draw_lines(shape, int(rng.integers(0, p.max_scratches + 1)), rng)
    lifted = np.clip(1 - on_print + p.ragged * smooth_noise(shape, 5 * px, rng), 0, 1) ** 2
    missing = np.maximum(np.maximum(p.creases * creases, scratches), lifted)
    threshold += OFF_THE_GLASS * missing
    worn = 1 + np.tanh(smooth_noise(shape, px * p.wear_extent_px, rng))
    grain = 0.75 * smooth_noise(shape, 1.3 * px, rng) + 0.5 * smooth_noise(shape, 3.0 * px, rng)
    strength = 1 - rng.uniform(*p.wear) * worn / 2
    grain *= p.grain
    if any(p.beading):
        beading = rng.uniform(*p.beading)
        for extent, share in BEADS:
            beads = smooth_noise(shape, px * extent * p.beading_extent_px, rng)
            grain += beading * share * beads
        threshold += rng.uniform(*p.middle) * (np.minimum(radius, 1.2) ** 2 - MEAN_SQUARE_RADIUS)
    layers = (threshold, strength, grain)
    return Contact(*(np.asarray(layer, np.float32) for layer in layers))


def is_legible(
    points: NDArray[np.floating], contact: Contact, px: float = 1.0
) -> NDArray[np.bool_]:
    """Return whether ridges can be distinguished from valleys at and around `points` (N, 2).

    False beyond the image and at its border, and within about half a ridge period of the end of the
    print, where an ending cannot be distinguished from a ridge that is cut off.
    """
    import cv2  # noqa: PLC0415

    rows, columns = contact.threshold.shape
    x, y = np.rint(points).astype(np.intp).T
    border = BORDER_PX * px
    inside = (x >= border) & (x < columns - border) & (y >= border) & (y < rows - border)
    position = np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)
    doubt = np.abs(contact.threshold) / contact.strength
    missing = (doubt > 1).astype(np.float32)
    at_point = cv2.GaussianBlur(doubt, (0, 0), POINT_SIGMA_PX * px)[position]
    around = cv2.GaussianBlur(missing, (0, 0), AROUND_SIGMA_PX * px)[position]
    return np.asarray(inside & (at_point < LEGIBLE) & (around < MOST_MISSING))


def _spot(
    radius: NDArray[np.floating], extent_px: float, px: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the change of threshold by one ragged spot at a random place in the contact."""
    rows, columns = radius.shape
    y0, x0 = rng.uniform(0.1, 0.9, 2) * (rows, columns)
    stretch = rng.uniform(0.6, 1.6)
    y, x = np.arange(rows)[:, None] - y0, np.arange(columns) - x0
    inside = np.exp(-0.5 * ((x * stretch) ** 2 + (y / stretch) ** 2) / extent_px**2)
    ragged = np.clip(0.8 + 0.5 * smooth_noise((rows, columns), SPOT_EXTENT_PX * px, rng), 0, 1.6)
    return np.asarray(rng.choice((WET_SPOT, DRY_SPOT)) * inside * ragged)


def stain(
    touching: NDArray[np.floating], rng: np.random.Generator, p: SmearParameters, px: float = 1.0
) -> Field:
    """Return the share of ink that damp and grease leave between the ridges, (h, w).

    `touching` is 1 where the finger touches; `px` is the number of image pixels for one at 500 dpi.
    """
    darkest = rng.uniform(*p.stain)
    shape = (touching.shape[0], touching.shape[1])
    patches = np.clip(smooth_noise(shape, p.stain_extent_px * px, rng), 0, 2) / 2
    return np.asarray(darkest * patches * touching, np.float32)


def smear(
    relief: Field, rng: np.random.Generator, p: SmearParameters, px: float = 1.0
) -> tuple[Field, Field]:
    """Blur the skin (h, w) in patches along one direction, as if it had moved there.

    Returns the relief, and the share of the blur: 0 where it is unchanged, 1 in the middle of a
    patch.
    """
    import cv2  # noqa: PLC0415

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
