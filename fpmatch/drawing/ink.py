"""A print becomes an ink: how much of each pixel is ridge, evened out so that faint prints show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from fpmatch.errors import ImageError
from fpmatch.minutiae import STANDARD_DPI, RidgeField

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class InkParameters:
    """Hold how a print is evened out; lengths in pixels at 500 dpi.

    Parameters
    ----------
    mean_px : float
        Gaussian deviation of the neighbourhood whose mean parts ridges from valleys.
    contrast_px : float
        Gaussian deviation of the neighbourhood over which contrast is measured: two ridges.
    smoothing_px : float
        Gaussian deviation of the smoothing that takes off the grain.
    lightest, darkest : float
        Darkness against the local mean, in local deviations, at which the ink begins and is full.
    typical_percentile : float
        Percentile of the local deviations that counts as the print's own contrast.
    bare_below, full_above : float
        Shares of that contrast below which a place is bare paper, and above which it is print.
    least_contrast : float
        Grey levels under which contrast is the sensor's noise, not ridges.
    off_print : float
        How much ink is left where the print's own mask says that there are no ridges.
    """

    mean_px: float = 6.0
    contrast_px: float = 10.0
    smoothing_px: float = 0.6
    lightest: float = 0.0
    darkest: float = 0.8
    typical_percentile: float = 85.0
    bare_below: float = 0.15
    full_above: float = 0.40
    least_contrast: float = 3.0
    off_print: float = 0.2


def grey_pixels(name: str, image: Any) -> NDArray[np.uint8]:
    """Return the pixels of an array or of an object that holds them as ``pixels``.

    Parameters
    ----------
    name : str
        What to call the image in an error.
    image : ndarray of uint8, shape (H, W), or object with such an array as its ``pixels``
        The grey image.

    Returns
    -------
    ndarray of uint8, shape (H, W)
        The pixels, not copied.

    Raises
    ------
    ImageError
        If it is neither, or has no pixels.
    """
    pixels = np.asarray(getattr(image, "pixels", image))
    if pixels.dtype != np.uint8 or pixels.ndim != 2 or pixels.size == 0:
        raise ImageError(
            f"{name}: expected a grey image of 8 bits, shape (H, W), "
            f"not {pixels.dtype} of shape {pixels.shape}"
        )
    return pixels


def ink_coverage(
    pixels: NDArray[np.uint8],
    dpi: float,
    parameters: InkParameters | None = None,
) -> NDArray[np.uint8]:
    """Turn a grey print into the coverage of an ink: ridges full, valleys and background bare.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (H, W)
        Grey image, ridges dark.
    dpi : float
        Its resolution in dots per inch.
    parameters : InkParameters, optional
        Neighbourhoods and contrasts.

    Returns
    -------
    ndarray of uint8, shape (H, W)
        0 bare to 255 full.

    Examples
    --------
    >>> ink_coverage(np.full((40, 40), 128, np.uint8), dpi=500).max()
    np.uint8(0)
    """
    p = parameters or InkParameters()
    scale = dpi / STANDARD_DPI
    grey = pixels.astype(np.float32)
    mean = _blurred(grey, p.mean_px * scale)
    variance = _blurred((grey - mean) ** 2, p.contrast_px * scale)
    deviation = np.sqrt(np.maximum(variance, 0))
    darkness = (mean - _blurred(grey, p.smoothing_px * scale)) / np.maximum(deviation, 1e-3)
    tone = np.clip((darkness - p.lightest) / (p.darkest - p.lightest), 0, 1)
    typical = max(float(np.percentile(deviation, p.typical_percentile)), 2 * p.least_contrast)
    bare = max(p.bare_below * typical, p.least_contrast)
    full = max(p.full_above * typical, 2 * bare)
    printed = np.clip((deviation - bare) / (full - bare), 0, 1)
    return np.asarray(np.rint(255 * tone * printed), dtype=np.uint8)


def thinned_off_print(
    coverage: NDArray[np.uint8],
    field: RidgeField,
    factor: float = 1.0,
    parameters: InkParameters | None = None,
) -> NDArray[np.uint8]:
    """Thin an ink where the print has no ridges, so that dirt and frames do not distract.

    Parameters
    ----------
    coverage : ndarray of uint8, shape (H, W)
        The ink of a print, or of one shrunk by `factor`.
    field : RidgeField
        Where the print has ridges; one cell more is left on every side.
    factor : float
        Pixels of `coverage` to one of the print.
    parameters : InkParameters, optional
        How much is left.

    Returns
    -------
    ndarray of uint8, shape (H, W)
        The thinner ink; the same where the field knows of no ridges at all.

    Examples
    --------
    >>> nowhere = RidgeField(8.0, np.zeros((5, 5)), np.zeros((5, 5), bool))
    >>> thinned_off_print(np.full((40, 40), 200, np.uint8), nowhere).min()
    np.uint8(200)
    """
    if not field.mask.any():
        return coverage
    left = (parameters or InkParameters()).off_print
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
    return np.rint(coverage * (left + (1 - left) * on_print)).astype(np.uint8)


def _blurred(values: NDArray[np.float32], sigma: float) -> NDArray[np.float32]:
    blurred = cv2.GaussianBlur(values, (0, 0), sigma, borderType=cv2.BORDER_REFLECT)
    return np.asarray(blurred, dtype=np.float32)


def shrunk(pixels: NDArray[np.uint8], factor: float) -> NDArray[np.uint8]:
    """Return `pixels` made smaller by `factor` (at most 1), each new pixel a mean of old ones."""
    height, width = pixels.shape
    size = (max(round(width * factor), 1), max(round(height * factor), 1))
    if size == (width, height) or factor >= 1:
        return pixels
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
