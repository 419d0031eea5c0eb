"""Minutiae of columns as files have them, of any numeric type."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fpmatch.minutiae import Minutiae

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def minutiae_of(
    x: ArrayLike, y: ArrayLike, angle: ArrayLike, kind: ArrayLike, quality: ArrayLike
) -> Minutiae:
    """Return the minutiae of some columns; `Minutiae` makes them the arrays it keeps.

    Raises
    ------
    MinutiaeError
        As `Minutiae` does.
    """
    return Minutiae(x, y, angle, kind, quality)  # type: ignore[arg-type]
