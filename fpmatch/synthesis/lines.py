"""Thin bent lines across a print: the creases of a finger, the scratches of one impression."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.synthesis.noise import smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class LineParameters:
    """Set how lines run; lengths are pixels."""

    step_px: float = 8.0
    steps: tuple[int, int] = (4, 17)  # fewest, and one more than most
    tilt: float = 0.7  # largest angle to the horizontal, radians
    bend: float = 0.06  # standard deviation of the turn at a step, radians
    widths_px: tuple[int, ...] = (1, 1, 2, 2, 3, 4)
    middle: tuple[float, float] = (0.2, 0.8)  # where they start, shares of the sides
    softness_px: float = 1.0
    depth: tuple[float, float] = (0.7, 1.3)


def draw_lines(
    shape: tuple[int, int],
    count: int,
    rng: np.random.Generator,
    parameters: LineParameters | None = None,
    *,
    broken_extent_px: float = 4.0,
) -> NDArray[np.float32]:
    """Draw thin, slightly bent, tapering, broken lines.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns.
    count : int
        How many lines.
    rng : numpy.random.Generator
        Where they come from.
    parameters : LineParameters, optional
        How they run.
    broken_extent_px : float, optional
        Length over which their depth comes and goes (default 4).

    Returns
    -------
    ndarray of float32, shape (rows, columns)
        0 beside the lines to 1 in them.

    Examples
    --------
    >>> lines = draw_lines((200, 160), 3, np.random.default_rng(1))
    >>> float(lines.min()), bool(0.3 < lines.max() <= 1)
    (0.0, True)
    """
    import cv2  # noqa: PLC0415

    p = parameters or LineParameters()
    lines = np.zeros(shape, np.float32)
    if not count:
        return lines
    for _ in range(count):
        steps = int(rng.integers(*p.steps))
        heading = rng.uniform(-p.tilt, p.tilt) + rng.choice((0, np.pi))
        headings = heading + np.cumsum(rng.normal(scale=p.bend, size=steps))
        moves = p.step_px * np.column_stack([np.cos(headings), np.sin(headings)])
        start = rng.uniform(*p.middle, 2) * np.array(shape[::-1])
        path = np.rint(start + np.cumsum(moves, axis=0)).astype(int).tolist()
        width = int(rng.choice(p.widths_px))
        taper = np.sin(np.linspace(0.3, np.pi - 0.3, steps))
        depths = (taper * rng.uniform(*p.depth, steps)).tolist()
        for begin, end, depth in zip(path, path[1:], depths, strict=False):
            cv2.line(lines, begin, end, depth, width)
    broken = 0.75 + 0.35 * smooth_noise(shape, broken_extent_px, rng)
    soft = cv2.GaussianBlur(lines, (0, 0), p.softness_px)
    return np.asarray(np.clip(soft * broken, 0, 1), np.float32)
