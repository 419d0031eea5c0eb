"""Resolutions of template files, in pixels a centimetre, as dots per inch and back."""

from __future__ import annotations

import math
from typing import Final

from fpmatch.errors import TemplateError

CM_PER_INCH: Final = 2.54
ROUND_DPI: Final = 100  # what scanners are built for are multiples of this
MISMATCH: Final = 0.01  # of horizontal and vertical resolution, that rounding may explain


def per_cm(dpi: float) -> int:
    """Return a resolution in whole pixels a centimetre.

    Examples
    --------
    >>> per_cm(500)
    197
    """
    return round(dpi / CM_PER_INCH)


def dpi_of(per_cm_x: int, per_cm_y: int) -> float:
    """Return the dots per inch that whole pixels a centimetre stand for.

    Such a number stands for a range of 2.54 dpi: a multiple of 100 in it is meant, else the
    nearest whole number.

    Parameters
    ----------
    per_cm_x, per_cm_y : int
        Horizontal and vertical resolution, positive.

    Returns
    -------
    float
        The resolution of both.

    Raises
    ------
    TemplateError
        If the two differ by more than 1 %.

    Examples
    --------
    >>> dpi_of(197, 197), dpi_of(224, 224)
    (500.0, 569.0)
    """
    if abs(per_cm_x - per_cm_y) > max(1.0, MISMATCH * per_cm_x):
        raise TemplateError(
            f"horizontal and vertical resolution differ ({per_cm_x} and {per_cm_y} pixels a cm)"
        )
    low, high = (per_cm_x - 0.5) * CM_PER_INCH, (per_cm_x + 0.5) * CM_PER_INCH
    multiple = math.ceil(low / ROUND_DPI) * ROUND_DPI
    return float(multiple if multiple < high else round(per_cm_x * CM_PER_INCH))
