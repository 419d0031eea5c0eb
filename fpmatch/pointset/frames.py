"""Ways into a set's unit frame and out again, for matchers that work there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from fpmatch.errors import PointSetError
from fpmatch.pointset.points import IDENTITY, UnitFrame
from fpmatch.pointset.similarity import Similarity

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.pointset.points import Box

MAX_EXPONENT: Final = 300
"""Coordinates and extents reach 2**±300, so that no transform between sets leaves float64."""

MODERATE_EXPONENT: Final = 60
"""Coordinates and extents within 2**±60 need no frame."""


def frame_of(points: NDArray[np.float64], name: str = "points") -> UnitFrame:
    """Return the unit frame of a set, or refuse it where transforms would leave float64.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        The points.
    name : str
        What to call them in an error.

    Returns
    -------
    UnitFrame
        The frame.

    Raises
    ------
    PointSetError
        If coordinates or extent are beyond 2**±300.

    Examples
    --------
    >>> import numpy as np
    >>> frame_of(np.array([[10.0, 20.0], [16.0, 20.0]])).exponent
    3
    """
    frame = UnitFrame.of(points)
    if len(points) and max(frame.magnitude, -frame.exponent) > MAX_EXPONENT:
        raise PointSetError(f"{name}: coordinates or extent beyond 2**±{MAX_EXPONENT}")
    return frame


def frame_if_needed(points: NDArray[np.float64], box: Box, name: str = "points") -> UnitFrame:
    """Return the frame of a set, the identity where the set is in reach of float64 as it stands.

    See `frame_of`; `box` is the set's `box_of`. Squares of squares of lengths stay in reach then.
    """
    least, most = 2.0**-MODERATE_EXPONENT, 2.0**MODERATE_EXPONENT
    left, right, top, bottom = box
    if max(-left, right, -top, bottom) < most and max(right - left, bottom - top) > least:
        return IDENTITY
    return frame_of(points, name)


def to_unit_frame(frame: UnitFrame) -> Similarity:
    """Return the transform from points as given into their unit frame."""
    if frame is IDENTITY:
        return Similarity()
    x0, y0 = math.ldexp(frame.x0, -frame.span), math.ldexp(frame.y0, -frame.span)
    return Similarity(math.ldexp(1.0, -frame.exponent), 0.0, -x0, -y0)


def between_sets(move: Similarity, frame_p: UnitFrame, frame_q: UnitFrame) -> Similarity:
    """Return the transform between two sets as given, of a move between their unit frames."""
    if frame_p is frame_q is IDENTITY:
        return move
    return to_unit_frame(frame_q).inverse().after(move).after(to_unit_frame(frame_p))
