"""A print as an ink, with faint prints as visible as others, and the ridges of a template."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.errors import ImageError
from fpmatch.templates.bounds import check_area
from fpmatch.templates.minutiae import STANDARD_DPI
from fpmatch.templates.ridge_field import CELL_BITS, RidgeField

if TYPE_CHECKING:
    from numpy.typing import NDArray

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


def grey_pixels(name: str, image: Any) -> Pixels:
    """Return the pixels of an array, or of an object with ``pixels``; they are not copied.

    An `ImageError`, which begins with `name`, is raised if they are not uint8 of shape (H, W).
    """
    pixels = np.asarray(getattr(image, "pixels", image))
    if pixels.dtype != np.uint8 or pixels.ndim != 2 or pixels.size == 0:
        raise ImageError(
            f"{name}: expected a grey image of 8 bits, shape (H, W), "
            f"not {pixels.dtype} of shape {pixels.shape}"
        )
    return pixels


def ink_coverage(pixels: Pixels, dpi: float) -> Pixels:
    """Convert a grey print (H, W), ridges dark, to an ink's coverage: 0 bare to 255 full."""
    scale = dpi / STANDARD_DPI
    grey = pixels.astype(np.float32)
    mean = _blurred(grey, _MEAN_PX * scale)
    deviation = np.sqrt(np.maximum(_blurred((grey - mean) ** 2, _CONTRAST_PX * scale), 0))
    darkness = (mean - _blurred(grey, _SMOOTHING_PX * scale)) / np.maximum(deviation, 1e-3)
    tone = np.clip(darkness / _FULL_DARKNESS, 0, 1)
    place = int(_TYPICAL_SHARE * (deviation.size - 1))
    typical = max(float(np.partition(deviation, place, axis=None)[place]), 2 * _LEAST_CONTRAST)
    bare = max(_BARE_BELOW * typical, _LEAST_CONTRAST)
    full = max(_FULL_ABOVE * typical, 2 * bare)
    printed = np.clip((deviation - bare) / (full - bare), 0, 1)
    return np.asarray(np.rint(255 * tone * printed), dtype=np.uint8)


def thinned_off_print(coverage: Pixels, field: RidgeField, factor: float = 1.0) -> Pixels:
    """Lighten an ink (H, W) outside the ridges of a print, so that dirt and frames do not distract.

    `coverage` is the ink of a print shrunk by `factor`; one cell is added on every side of the
    field's mask of ridges. The ink is unchanged where the mask is empty.
    """
    if not field.mask.any():
        return coverage
    cells = cv2.dilate(field.mask.astype(np.float32), np.ones((3, 3), np.uint8))
    start = (0.5 / factor - 0.5) / field.step - 0.5
    beyond = cv2.BORDER_REPLICATE
    on_print = at_pixels(cells, 1 / (factor * field.step), start, coverage.shape, beyond)
    return np.rint(coverage * (_OFF_PRINT + (1 - _OFF_PRINT) * on_print)).astype(np.uint8)


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
    ridges = at_pixels(bits, scale, 0.5 * scale - 0.5, shape, cv2.BORDER_CONSTANT)
    return np.rint(_PAPER - (_PAPER - _RIDGE) * ridges).astype(np.uint8)


def at_pixels(
    cells: NDArray[Any], scale: float, start: float, shape: tuple[int, ...], beyond: int
) -> NDArray[np.float32]:
    """Interpolate a grid of cells at pixels: pixel k lies at the cell `start` + k * `scale`."""
    to_cells = np.array([[scale, 0, start], [0, scale, start]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    sampled = cv2.warpAffine(cells, to_cells, shape[::-1], flags=flags, borderMode=beyond)
    return np.asarray(sampled, dtype=np.float32)


def _blurred(values: NDArray[np.float32], sigma: float) -> NDArray[np.float32]:
    blurred = cv2.GaussianBlur(values, (0, 0), sigma, borderType=cv2.BORDER_REFLECT)
    return np.asarray(blurred, dtype=np.float32)


def shrunk(pixels: Pixels, factor: float) -> Pixels:
    """Return `pixels` made smaller by `factor` (at most 1), each new pixel a mean of old ones."""
    height, width = pixels.shape[:2]
    size = (max(round(width * factor), 1), max(round(height * factor), 1))
    if size == (width, height) or factor >= 1:
        return pixels
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
