"""A print as an ink, with faint prints as visible as others, and the ridges of a template."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.drawing.scene.items import Ink, zoomed
from fpmatch.errors import TemplateError
from fpmatch.templates.bounds import check_area
from fpmatch.templates.minutiae import CELL_BITS, STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Matrix
    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.prints.reading import GivenPrint
    from fpmatch.templates.minutiae import Template

    Pixels = NDArray[np.uint8]

# Gaussian deviations in pixels at 500 dpi.
_MEAN_PX: Final = 6.0  # of the neighbourhood whose mean separates ridges from valleys
_CONTRAST_PX: Final = 10.0  # of the neighbourhood over which contrast is measured: two ridges
_SMOOTHING_PX: Final = 0.6
_FULL_DARKNESS: Final = 0.8  # below the local mean, in local deviations, at which the ink is full
_TYPICAL_SHARE: Final = 0.85  # of the local deviations are below the print's own contrast
_BARE_BELOW, _FULL_ABOVE = 0.15, 0.40  # shares of that contrast: bare paper, and print
_LEAST_CONTRAST: Final = 3.0  # grey levels; less is noise of the sensor
_RIDGE, _PAPER = 40, 255  # grey values of a template's ridges
_OFF_PRINT: Final = 0.2  # share of the ink that is left outside the print's own mask
_LARGEST_SIDE: Final = 4000  # pixels of a print; a larger one is shrunk first
_SAMPLE: Final = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP  # of a grid of cells at pixels
_MAGNIFICATIONS: Final = (1e-3, 1e3)  # outside, a print is a dot or one flat pixel: not drawn


def ink_coverage(pixels: Pixels, dpi: float) -> Pixels:
    """Convert a grey print (H, W), ridges dark, to an ink's coverage: 0 bare to 255 full."""
    scale = dpi / STANDARD_DPI
    grey = pixels.astype(np.float32)
    mean = cv2.GaussianBlur(grey, (0, 0), _MEAN_PX * scale)
    variance = cv2.GaussianBlur((grey - mean) ** 2, (0, 0), _CONTRAST_PX * scale)
    deviation = np.sqrt(np.maximum(variance, 0))
    smooth = cv2.GaussianBlur(grey, (0, 0), _SMOOTHING_PX * scale)
    darkness = (mean - smooth) / np.maximum(deviation, 1e-3)
    tone = np.clip(darkness / _FULL_DARKNESS, 0, 1)
    place = int(_TYPICAL_SHARE * (deviation.size - 1))
    typical = max(float(np.partition(deviation, place, axis=None)[place]), 2 * _LEAST_CONTRAST)
    bare = max(_BARE_BELOW * typical, _LEAST_CONTRAST)
    full = max(_FULL_ABOVE * typical, 2 * bare)
    printed = np.clip((deviation - bare) / (full - bare), 0, 1)
    return np.asarray(np.rint(255 * tone * printed), dtype=np.uint8)


def ink_of(
    pixels: Pixels, template: Template, matrix: Matrix, colour: Colour, role: str
) -> tuple[Ink, ...]:
    """Return a print as an ink on a page, thinned where it has no ridges.

    Dirt and frames distract less so. The mask of ridges of the template is extended by one cell on
    every side; without a mask the ink is nowhere thinned.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (H, W)
        The grey image, ridges dark.
    template : Template
        Its template: resolution and mask of ridges.
    matrix : ndarray of float64, shape (3, 3)
        Maps the pixels to the page.
    colour, role : Colour, str
        Of the ink.

    Returns
    -------
    tuple of Ink
        One ink; none where the print would be too small or too large to be drawn.
    """
    magnification = math.hypot(matrix[0, 0], matrix[1, 0])
    low, high = _MAGNIFICATIONS
    if not low <= magnification <= high:
        return ()
    factor = min(magnification, 1.0, _LARGEST_SIDE / max(pixels.shape))
    coverage = ink_coverage(shrunk(pixels, factor), template.dpi * factor)
    field = template.field
    if field is not None and field.mask.any():
        cells = cv2.dilate(field.mask.astype(np.float32), np.ones((3, 3), np.uint8))
        start = (0.5 / factor - 0.5) / field.step - 0.5
        scale = 1 / (factor * field.step)
        to_cells = np.array([[scale, 0, start], [0, scale, start]])
        size = coverage.shape[::-1]
        on_print = cv2.warpAffine(
            cells, to_cells, size, flags=_SAMPLE, borderMode=cv2.BORDER_REPLICATE
        )
        thinned = coverage * (_OFF_PRINT + (1 - _OFF_PRINT) * on_print)
        coverage = np.rint(thinned).astype(np.uint8)
    to_print = zoomed(1 / factor, (-0.5, -0.5), (-0.5, -0.5))
    return (Ink(coverage, colour, matrix @ to_print, role),)


def print_picture(given: GivenPrint) -> Pixels:
    """Return the pixels of an image; of a template, its ridges as `ridge_picture` draws them."""
    if given.image is not None:
        return given.image.pixels
    try:
        return ridge_picture(given.template)
    except TemplateError as error:
        raise TemplateError(str(error), path=given.name) from error


def ridge_picture(template: Template) -> Pixels:
    """Draw the ridges that a template contains, dark on white, (height, width) as its image.

    Raises TemplateError if it states more pixels than a print has.
    """
    check_area(template)
    shape, field = (template.height, template.width), template.field
    if field is None or field.ridges is None:
        return np.full(shape, _PAPER, np.uint8)
    bits = field.bits.astype(np.float32)
    # Bit k of a row of cells covers the pixels from k * step / 8 on.
    scale = CELL_BITS / field.step
    start = 0.5 * scale - 0.5
    to_bits = np.array([[scale, 0, start], [0, scale, start]])
    ridges = cv2.warpAffine(bits, to_bits, shape[::-1], flags=_SAMPLE)
    return np.rint(_PAPER - (_PAPER - _RIDGE) * ridges).astype(np.uint8)


def shrunk(pixels: Pixels, factor: float) -> Pixels:
    """Return `pixels` made smaller by `factor` (at most 1), each new pixel a mean of old ones."""
    height, width = pixels.shape[:2]
    size = (max(round(width * factor), 1), max(round(height * factor), 1))
    if size == (width, height) or factor >= 1:
        return pixels
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
