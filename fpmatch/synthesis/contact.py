"""How skin touches the glass: which height of relief prints where, and where it can be read."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.synthesis.lines import draw_lines
from fpmatch.synthesis.noise import smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.synthesis.classes import Range

    Field = NDArray[np.float32]  # a value a pixel

EDGE_START: Final = 0.86  # radius from which the skin lifts off the glass
EDGE_STEEPNESS: Final = 50.0  # relief by which it has lifted one radius further out
OFF_THE_GLASS: Final = 3.0  # relief by which skin lies too deep to touch at all
WET_SPOT, DRY_SPOT = -0.75, 0.7  # relief by which a spot's threshold differs
SPOT_EXTENT_PX: Final = 9.0  # of the ragged edge of a spot, and half its least radius


@dataclass(frozen=True, slots=True)
class PressureParameters:
    """Set how a finger is pressed; lengths are pixels at 500 dpi, heights those of the relief."""

    dryness: Range = (-0.15, 0.2)  # height below which nothing prints; negative is wet
    unevenness: float = 0.12  # standard deviation of the dryness over the print
    unevenness_extent_px: float = 40.0
    tilt: Range = (0.0, 0.15)  # by how much one side is drier than the middle
    grain: float = 0.2  # roughness that this impression does not share with others
    wear: Range = (0.0, 0.1)  # share of the relief that worn skin lacks
    wear_extent_px: float = 45.0
    creases: float = 1.0  # depth at which those of the finger show
    max_scratches: int = 1
    max_spots: int = 1  # too wet or too dry
    spot_radius_px: Range = (16.0, 48.0)
    outline: float = 0.03  # standard deviation of the outline, shares of its radius
    ragged: float = 0.035  # and of its fine raggedness


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """Hold how one finger touches, pixel by pixel of the picture.

    Parameters
    ----------
    threshold : ndarray of float32, shape (h, w)
        Height that skin must have to print.
    strength : ndarray of float32, shape (h, w)
        Share of the relief that wear has left.
    grain : ndarray of float32, shape (h, w)
        Roughness to add to the relief.
    """

    threshold: Field = field(repr=False)
    strength: Field = field(repr=False)
    grain: Field = field(repr=False)


TIP_EXPONENT, FOOT_EXPONENT = 2.1, 2.7  # of the superellipse: 2 is round, more is squarer


def outline_radius(upright: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return how far out points of a contact lie: round at the tip, squarer towards the joint.

    Parameters
    ----------
    upright : ndarray of float, shape (N, 2)
        Points across and along the finger, from the middle of the contact, in half axes; the
        joint lies at positive y.

    Returns
    -------
    ndarray of float64, shape (N,)
        0 in the middle, 1 on the outline.

    Examples
    --------
    >>> outline_radius(np.array([[0.0, 0.5], [-1.0, 0.0], [0.8, 0.8]])).round(2).tolist()
    [0.5, 1.0, 1.03]
    """
    across, along = np.abs(upright).T
    exponent = np.where(upright[:, 1] > 0, FOOT_EXPONENT, TIP_EXPONENT)
    return np.asarray((across**exponent + along**exponent) ** (1 / exponent))


def press(
    radius: NDArray[np.floating],
    on_print: NDArray[np.floating],
    creases: NDArray[np.floating],
    rng: np.random.Generator,
    parameters: PressureParameters | None = None,
    *,
    px: float = 1.0,
) -> Contact:
    """Press a finger on the glass once.

    Parameters
    ----------
    radius : ndarray of float, shape (h, w)
        How far out each pixel lies in the contact: 0 in its middle, 1 on its outline.
    on_print : ndarray of float, shape (h, w)
        1 on the skin of the print, falling towards its border, 0 beyond.
    creases : ndarray of float, shape (h, w)
        0 to 1: where a crease of the finger lies.
    rng : numpy.random.Generator
        Where pressure, moisture and scratches come from.
    parameters : PressureParameters, optional
        Their ranges.
    px : float, optional
        Pixels of the picture for one at 500 dpi (default 1).

    Returns
    -------
    Contact
        What prints.

    Examples
    --------
    >>> y, x = np.mgrid[-1.2:1.2:120j, -1.2:1.2:100j]
    >>> flat = np.zeros((120, 100))
    >>> contact = press(np.hypot(x, y), flat + 1, flat, np.random.default_rng(1))
    >>> bool(contact.threshold[60, 50] < 1 < contact.threshold[0, 0])
    True
    """
    p = parameters or PressureParameters()
    shape = (radius.shape[0], radius.shape[1])
    threshold = rng.uniform(*p.dryness) + p.unevenness * smooth_noise(
        shape, px * p.unevenness_extent_px, rng
    )
    threshold += rng.uniform(*p.tilt) * _towards_one_side(radius, rng)
    for _ in range(int(rng.integers(0, p.max_spots + 1))):
        threshold += _spot(radius, rng.uniform(*p.spot_radius_px) * px, px, rng)
    outline = 1 + p.outline * smooth_noise(shape, 60 * px, rng)
    out = radius * outline + p.ragged * smooth_noise(shape, 5 * px, rng)
    threshold += EDGE_STEEPNESS * np.clip(out - EDGE_START, 0, None) ** 2
    scratches = draw_lines(shape, int(rng.integers(0, p.max_scratches + 1)), rng)
    lifted = np.clip(1 - on_print + p.ragged * smooth_noise(shape, 5 * px, rng), 0, 1) ** 2
    missing = np.maximum(np.maximum(p.creases * creases, scratches), lifted)
    threshold += OFF_THE_GLASS * missing
    worn = 1 + np.tanh(smooth_noise(shape, px * p.wear_extent_px, rng))
    grain = 0.75 * smooth_noise(shape, 1.3 * px, rng) + 0.5 * smooth_noise(shape, 3.0 * px, rng)
    return Contact(
        threshold=threshold.astype(np.float32),
        strength=np.asarray(1 - rng.uniform(*p.wear) * worn / 2, np.float32),
        grain=np.asarray(p.grain * grain, np.float32),
    )


LEGIBLE: Final = 0.85  # a threshold beyond this share of the relief fills valleys or loses ridges
LOOKED_AT_PX: Final = 2.5  # standard deviation of the place by which a minutia is judged
LOOKED_AROUND_PX: Final = 5.0  # and of its surroundings, about half a ridge period
MOST_MISSING: Final = 0.15  # share of the surroundings that may be without legible ridges
BORDER_PX: Final = 7.0  # nothing is legible nearer the picture's border


def is_legible(
    points: NDArray[np.floating], contact: Contact, *, px: float = 1.0
) -> NDArray[np.bool_]:
    """Return whether ridges can be told from valleys at points of a picture and around them.

    Within about half a ridge period of the end of the print, a ridge that ends cannot be told
    from one that is cut off.

    Parameters
    ----------
    points : ndarray of float, shape (N, 2)
        x and y in pixels of the picture.
    contact : Contact
        How the finger touched.
    px : float, optional
        Pixels of the picture for one at 500 dpi (default 1).

    Returns
    -------
    ndarray of bool, shape (N,)
        False also beyond the picture and on its very border.

    Examples
    --------
    >>> dry = np.tile(np.linspace(0, 2, 60, dtype=np.float32), (40, 1))
    >>> contact = Contact(dry, np.ones_like(dry), np.zeros_like(dry))
    >>> is_legible(np.array([[10.0, 20.0], [50.0, 20.0], [-5.0, 9.0]]), contact).tolist()
    [True, False, False]
    """
    import cv2  # noqa: PLC0415

    rows, columns = contact.threshold.shape
    x, y = np.rint(points).astype(np.intp).T
    border = BORDER_PX * px
    inside = (x >= border) & (x < columns - border) & (y >= border) & (y < rows - border)
    place = np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)
    doubt = np.abs(contact.threshold) / contact.strength
    missing = (doubt > 1).astype(np.float32)
    at_point = cv2.GaussianBlur(doubt, (0, 0), LOOKED_AT_PX * px)[place]
    around = cv2.GaussianBlur(missing, (0, 0), LOOKED_AROUND_PX * px)[place]
    return np.asarray(inside & (at_point < LEGIBLE) & (around < MOST_MISSING))


def _towards_one_side(
    radius: NDArray[np.floating], rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return a slope across the picture in a random direction: -1 to 1 from side to side."""
    rows, columns = radius.shape
    angle = rng.uniform(0, 2 * np.pi)
    y, x = np.linspace(-1, 1, rows)[:, None], np.linspace(-1, 1, columns)
    return np.asarray(np.cos(angle) * x + np.sin(angle) * y)


def _spot(
    radius: NDArray[np.floating], extent_px: float, px: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the change of threshold by one ragged spot, somewhere in the contact."""
    rows, columns = radius.shape
    y0, x0 = rng.uniform(0.1, 0.9, 2) * (rows, columns)
    stretch = rng.uniform(0.6, 1.6)
    y, x = np.arange(rows)[:, None] - y0, np.arange(columns) - x0
    inside = np.exp(-0.5 * ((x * stretch) ** 2 + (y / stretch) ** 2) / extent_px**2)
    ragged = np.clip(0.8 + 0.5 * smooth_noise((rows, columns), SPOT_EXTENT_PX * px, rng), 0, 1.6)
    return np.asarray(rng.choice((WET_SPOT, DRY_SPOT)) * inside * ragged)
