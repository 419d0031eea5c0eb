"""A print as an ink: how much of each pixel is ridge, with faint prints as visible as others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.errors import ImageError
from fpmatch.minutiae import STANDARD_DPI, RidgeField

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Pixels = NDArray[np.uint8]

# Gaussian deviations in pixels at 500 dpi.
_MEAN_PX: Final = 6.0  # of the neighbourhood whose mean separates ridges from valleys
_CONTRAST_PX: Final = 10.0  # of the neighbourhood over which contrast is measured: two ridges
_SMOOTHING_PX: Final = 0.6
_FULL_DARKNESS: Final = 0.8  # below the local mean, in local deviations, at which the ink is full
_TYPICAL_PERCENTILE: Final = 85.0  # of the local deviations: the print's own contrast
_BARE_BELOW, _FULL_ABOVE = 0.15, 0.40  # shares of that contrast: bare paper, and print
_LEAST_CONTRAST: Final = 3.0  # grey levels; less is noise of the sensor
_OFF_PRINT: Final = 0.2  # share of the ink that is left outside the print's own mask


def grey_pixels(name: str, image: Any) -> Pixels:
    """Return the pixels of an array, or of an object with ``pixels``; they are not copied.

    Raises
    ------
    ImageError
        If they are not uint8 of shape (H, W), or there are none; the message begins with `name`.
    """
    pixels = np.asarray(getattr(image, "pixels", image))
    if pixels.dtype != np.uint8 or pixels.ndim != 2 or pixels.size == 0:
        raise ImageError(
            f"{name}: expected a grey image of 8 bits, shape (H, W), "
            f"not {pixels.dtype} of shape {pixels.shape}"
        )
    return pixels


def ink_coverage(pixels: Pixels, dpi: float) -> Pixels:
    """Convert a grey print, ridges dark, to the coverage of an ink: ridges full, all else bare.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (H, W)
        Grey image, ridges dark.
    dpi : float
        Its resolution in dots per inch.

    Returns
    -------
    ndarray of uint8, shape (H, W)
        0 bare to 255 full.

    Examples
    --------
    >>> ink_coverage(np.full((40, 40), 128, np.uint8), dpi=500).max()
    np.uint8(0)
    """
    scale = dpi / STANDARD_DPI
    grey = pixels.astype(np.float32)
    mean = _blurred(grey, _MEAN_PX * scale)
    deviation = np.sqrt(np.maximum(_blurred((grey - mean) ** 2, _CONTRAST_PX * scale), 0))
    darkness = (mean - _blurred(grey, _SMOOTHING_PX * scale)) / np.maximum(deviation, 1e-3)
    tone = np.clip(darkness / _FULL_DARKNESS, 0, 1)
    typical = max(float(np.percentile(deviation, _TYPICAL_PERCENTILE)), 2 * _LEAST_CONTRAST)
    bare = max(_BARE_BELOW * typical, _LEAST_CONTRAST)
    full = max(_FULL_ABOVE * typical, 2 * bare)
    printed = np.clip((deviation - bare) / (full - bare), 0, 1)
    return np.asarray(np.rint(255 * tone * printed), dtype=np.uint8)


def thinned_off_print(coverage: Pixels, field: RidgeField, factor: float = 1.0) -> Pixels:
    """Thin an ink where the print has no ridges, so that dirt and frames do not distract.

    Parameters
    ----------
    coverage : ndarray of uint8, shape (H, W)
        The ink of a print, or of one shrunk by `factor`.
    field : RidgeField
        Its mask of ridges, to which one cell is added on every side.
    factor : float
        Pixels of `coverage` for each of the print.

    Returns
    -------
    ndarray of uint8, shape (H, W)
        The thinner ink; unchanged where the mask is empty.

    Examples
    --------
    >>> nowhere = RidgeField(8.0, np.zeros((5, 5)), np.zeros((5, 5), bool))
    >>> thinned_off_print(np.full((40, 40), 200, np.uint8), nowhere).min()
    np.uint8(200)
    """
    if not field.mask.any():
        return coverage
    cells = cv2.dilate(field.mask.astype(np.float32), np.ones((3, 3), np.uint8))
    height, width = coverage.shape
    pixels_to_cell = 1 / (factor * field.step)
    start = (0.5 / factor - 0.5) / field.step - 0.5
    to_cells = np.array([[pixels_to_cell, 0, start], [0, pixels_to_cell, start]])
    on_print = cv2.warpAffine(
        cells,
        to_cells,
        (width, height),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.rint(coverage * (_OFF_PRINT + (1 - _OFF_PRINT) * on_print)).astype(np.uint8)


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
