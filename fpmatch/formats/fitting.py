"""Fit minutiae into what a format can hold, and say what did not fit.

What is dropped, everywhere: minutiae that lie outside the print; then, of more minutiae than the
format counts, those of lowest quality, of equal ones the later. The others keep their order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fpmatch.errors import TemplateError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.minutiae import Minutiae, Template


def fit_minutiae(template: Template, most: int, notes: list[str]) -> Minutiae:
    """Return the minutiae of a template that lie inside it, the best if they are too many.

    Parameters
    ----------
    template : Template
        Its minutiae and frame.
    most : int
        How many the format can hold.
    notes : list of str
        Gets a line for each reason that minutiae were dropped for.

    Returns
    -------
    Minutiae
        Those that fit, in their order.
    """
    minutiae = template.minutiae
    inside = (
        (minutiae.x >= -0.5)
        & (minutiae.x <= template.width)
        & (minutiae.y >= -0.5)
        & (minutiae.y <= template.height)
    )
    if not inside.all():
        notes.append(f"{np.count_nonzero(~inside)} minutiae outside the print dropped")
        minutiae = minutiae.take(inside)
    if len(minutiae) > most:
        notes.append(f"{len(minutiae) - most} minutiae of lowest quality dropped: {most} fit in")
        best = np.argsort(-minutiae.quality.astype(np.int32), kind="stable")[:most]
        minutiae = minutiae.take(np.sort(best))
    return minutiae


def whole_pixels(values: NDArray[np.float32], side: int) -> NDArray[np.int64]:
    """Return positions along a side of `side` pixels as the nearest pixels of it."""
    return np.clip(np.rint(values.astype(np.float64)), 0, side - 1).astype(np.int64)


def whole_steps(angle: NDArray[np.float32], steps: int) -> NDArray[np.int64]:
    """Return angles in radians as the nearest of `steps` equal steps of a turn."""
    turns = angle.astype(np.float64) / (2 * np.pi)
    return np.mod(np.rint(turns * steps), steps).astype(np.int64)


def check_fits(value: int, bits: int, what: str) -> int:
    """Return a number that `bits` bits can hold.

    Raises
    ------
    TemplateError
        If they cannot.
    """
    if not 0 <= value < 2**bits:
        raise TemplateError(f"the format cannot hold {what} of {value}: {2**bits - 1} at most")
    return value
