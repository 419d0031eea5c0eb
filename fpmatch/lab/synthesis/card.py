"""What a card for rolled prints shows beside them: lines of boxes, printed words, handwriting."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Field = NDArray[np.float32]  # a value a pixel

WORDS: Final = ("RIGHT THUMB", "RIGHT INDEX", "RIGHT MIDDLE", "RIGHT RING", "RIGHT LITTLE",
                "LEFT THUMB", "LEFT INDEX", "LEFT MIDDLE", "LEFT RING", "LEFT LITTLE")  # fmt: skip
WORD_CHANCE, MOST_LINES, MOST_STROKES = 0.5, 3, 3
MARGIN: Final = 0.08  # share of the side within which lines and words lie
STROKE_STEP: Final = 0.025  # of handwriting, share of the side
STROKE_STEPS: Final = (12, 60)  # least, and one more than most
STROKE_TURN: Final = 0.35  # standard deviation of the change of its turn, radians


def draw_card(shape: tuple[int, int], rng: np.random.Generator) -> Field:
    """Return the ink of one card, 0 to 1, (h, w)."""
    import cv2  # noqa: PLC0415

    rows, columns = shape
    ink = np.zeros(shape, np.uint8)
    for _ in range(int(rng.integers(0, MOST_LINES + 1))):
        side = rows if rng.random() < 0.7 else columns
        near = rng.uniform(0, MARGIN) * side
        at, slope = (near if rng.random() < 0.5 else side - near), rng.normal(scale=0.01) * side
        ends = [(0.0, at), (float(columns), at + slope)]
        if side is columns:
            ends = [(at, 0.0), (at + slope, float(rows))]
        begin, end = (tuple(round(value) for value in point) for point in ends)
        cv2.line(ink, begin, end, rng.uniform(120, 255), int(rng.integers(1, 5)), cv2.LINE_AA)
    if rng.random() < WORD_CHANCE:
        text = f"{int(rng.integers(1, 11))}. {rng.choice(WORDS)}"
        place = (round(rng.uniform(-0.1, 0.4) * columns), round(rng.uniform(0.02, 0.1) * rows))
        size, width = rng.uniform(0.6, 1.1) * columns / 512, int(rng.integers(1, 4))
        font = int(rng.choice((cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_DUPLEX)))
        cv2.putText(ink, text, place, font, size, rng.uniform(150, 255), width, cv2.LINE_AA)
    for _ in range(int(rng.integers(0, MOST_STROKES + 1))):
        stroke = _handwriting(shape, rng)
        cv2.polylines(ink, [stroke], False, rng.uniform(100, 255), int(rng.integers(2, 6)))
    soft = cv2.GaussianBlur(ink.astype(np.float32), (0, 0), rng.uniform(0.6, 1.1))
    return np.asarray(soft / 255, np.float32)


def _handwriting(shape: tuple[int, int], rng: np.random.Generator) -> NDArray[np.int32]:
    """Return the points of one stroke of a pen near the border, (steps, 1, 2)."""
    steps = int(rng.integers(*STROKE_STEPS))
    turns = np.cumsum(rng.normal(scale=STROKE_TURN, size=steps))
    headings = rng.uniform(0, 2 * np.pi) + np.cumsum(np.clip(turns, -0.6, 0.6))
    moves = STROKE_STEP * max(shape) * np.column_stack([np.cos(headings), np.sin(headings)])
    start = rng.uniform(0, 1, 2)
    axis = int(rng.integers(2))
    start[axis] = np.rint(start[axis]) + rng.normal(scale=0.06)
    path = start * shape[::-1] + np.cumsum(moves, axis=0)
    return np.asarray(np.rint(path)[:, None], np.int32)
