"""Thin bent lines across a print: creases of a finger, scratches of one impression."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.synthesis.noise import smooth_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class LineParameters:
    """Set the course of lines; lengths in pixels."""

    step_px: float = 8.0
    steps: tuple[int, int] = (4, 17)  # least, and one more than most
    tilt: float = 0.7  # largest angle to the horizontal, radians
    bend: float = 0.06  # standard deviation of the turn at a step, radians
    widths_px: tuple[int, ...] = (1, 1, 2, 2, 3, 4)
    middle: tuple[float, float] = (0.2, 0.8)  # of their start, in shares of the sides
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
    """Draw `count` thin, slightly bent, tapering, broken lines: 0 beside them to 1 in them.

    `broken_extent_px` is the length over which their depth varies.
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
