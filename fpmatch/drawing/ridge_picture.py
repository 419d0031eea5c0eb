"""The ridges that a template contains, as a grey image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from fpmatch.minutiae import CELL_BITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.minutiae import Template

_RIDGE, _PAPER = 40, 255  # grey values


def ridge_picture(template: Template) -> NDArray[np.uint8]:
    """Draw the ridges that a template contains, dark, at the size of its image.

    Returns uint8 of shape (height, width); all white where the template has no ridges.

    Examples
    --------
    >>> from fpmatch.minutiae import Minutiae, Template
    >>> ridge_picture(Template(Minutiae.empty(), width=30, height=20)).min()
    np.uint8(255)
    """
    shape = (template.height, template.width)
    field = template.field
    if field is None or field.ridges is None:
        return np.full(shape, _PAPER, np.uint8)
    bits = field.bits.astype(np.float32)
    # Bit k of a row of cells covers the pixels from k * step / 8 on.
    pixels_to_bits = CELL_BITS / field.step
    start = 0.5 * pixels_to_bits - 0.5
    to_bits = np.array([[pixels_to_bits, 0, start], [0, pixels_to_bits, start]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    ridges = cv2.warpAffine(bits, to_bits, shape[::-1], flags=flags, borderValue=0)
    return np.rint(_PAPER - (_PAPER - _RIDGE) * ridges).astype(np.uint8)
