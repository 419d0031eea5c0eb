"""The paper's Figure 7: its matching algorithm as a flow chart."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.palette import (
    BAND,
    MATCH,
    NO_MATCH,
    PAPER,
    TEXT,
    TEXT_MUTED,
    Colour,
    hexadecimal,
)
from fpmatch.drawing.paper_figures.marks import LINES, OUTLINE, line
from fpmatch.drawing.paper_figures.sheet import Sheet
from fpmatch.drawing.paper_figures.text import LABEL_SIZE, POINTS_PER_PX, label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    Place = tuple[float, float]

HEIGHT: Final = 1010
BOX_WIDTH: Final = 330.0
SMALL_WIDTH: Final = 150.0
LINE_HEIGHT: Final = 19.0
BOX_ROOM: Final = 16.0  # pixels above and below the words of a box, together
DIAMOND: Final = (300.0, 84.0)
HEAD: Final = (7.0, 11.0)  # half width and length of an arrow's head
MIDDLE, LEFT, RIGHT = 380.0, 78.0, 650.0  # of the columns, from the left
CAPTION: Final = (
    "The algorithm as section 3.3 of the paper describes it: precomputation, then local matching "
    "of all combinations of a point p of P and a point q of Q, then global matching. The "
    "difference of the areas is compared with a threshold that the paper leaves open; ρ is the "
    "matching factor."
)


@dataclass(frozen=True, slots=True)
class Step:
    """Hold one box: its words, its middle, and whether it asks a question."""

    words: tuple[str, ...]
    at: Place
    question: bool = False
    width: float = BOX_WIDTH
    edge: Colour = TEXT_MUTED

    @property
    def half(self) -> Place:
        """Half its width and height."""
        if self.question:
            return DIAMOND[0] / 2, DIAMOND[1] / 2
        return self.width / 2, (LINE_HEIGHT * len(self.words) + BOX_ROOM) / 2

    @property
    def top(self) -> Place:
        """Where an arrow from above ends."""
        return self.at[0], self.at[1] - self.half[1]

    @property
    def bottom(self) -> Place:
        """Where an arrow downwards begins."""
        return self.at[0], self.at[1] + self.half[1]

    def side(self, sign: int) -> Place:
        """Return the middle of its left (-1) or right (1) side."""
        return self.at[0] + sign * self.half[0], self.at[1]


SETS: Final = Step(("Point sets P and Q",), (MIDDLE, 24.0), width=200.0)
PRECOMPUTATION: Final = Step(
    ("Precomputation of P and of Q:", "triangulation, unit-circle parametrization"), (MIDDLE, 98.0)
)
COMBINATION: Final = Step(("Next combination of p and q",), (MIDDLE, 176.0), width=240.0)
INTERIOR: Final = Step(("p and q", "interior points?"), (MIDDLE, 262.0), question=True)
DEGREE: Final = Step(("As many edges", "at p as at q?"), (MIDDLE, 376.0), question=True)
AREAS: Final = Step(
    ("Local matching: one-ring polygons of", "p and q on the unit circle, their areas"),
    (MIDDLE, 474.0),
)
THRESHOLD: Final = Step(
    ("Difference of areas", "below the threshold?"), (MIDDLE, 562.0), question=True
)
FACTOR: Final = Step(
    ("p and q match locally: transformation", "factor (rotation, scale, translation)"),
    (MIDDLE, 660.0),
)
ALL: Final = Step(("All combinations", "of p and q done?"), (MIDDLE, 748.0), question=True)
OVERLAP: Final = Step(
    ("Global matching: overlap P and Q", "by the transformation factor"), (MIDDLE, 846.0)
)
SHARE: Final = Step(("Share of matching", "points above ρ?"), (MIDDLE, 934.0), question=True)
MATCHED: Final = Step(
    ("P and Q match;", "time is recorded"), (RIGHT, 934.0), width=SMALL_WIDTH, edge=MATCH
)
NOT_MATCHED: Final = Step(("P and Q do", "not match"), (LEFT, 934.0), width=130.0, edge=NO_MATCH)
DOWNWARDS: Final = (
    SETS, PRECOMPUTATION, COMBINATION, INTERIOR, DEGREE, AREAS, THRESHOLD, FACTOR, ALL, OVERLAP,
    SHARE,
)  # fmt: skip
SKIPPED: Final = (INTERIOR, DEGREE, THRESHOLD)  # whose "no" leads to the next combination


def flow_chart() -> Sheet:
    """Draw Figure 7."""
    sheet = Sheet("Figure 7. The matching algorithm", CAPTION, 1, [HEIGHT])
    axes = sheet.panel(0, 0, "Boxes are steps, diamonds decisions")
    for above, below in pairwise(DOWNWARDS):
        _arrow(axes, [above.bottom, below.top])
        if above.question:
            _answer(axes, "yes", above.bottom, (20.0, 10.0))
    rail, again = LEFT + 60.0, COMBINATION.side(-1)
    for step in SKIPPED:
        start = step.side(-1)
        _path(axes, [start, (rail, start[1])])
        _answer(axes, "no", start, (-14.0, -9.0))
    lowest = THRESHOLD.side(-1)
    _arrow(axes, [(rail, lowest[1]), (rail, again[1]), again])
    start = ALL.side(1)
    back = COMBINATION.side(1)
    _arrow(axes, [start, (RIGHT, start[1]), (RIGHT, back[1]), back])
    _answer(axes, "no", start, (14.0, -9.0))
    for end, sign, answer in ((MATCHED, 1, "yes"), (NOT_MATCHED, -1, "no")):
        _arrow(axes, [SHARE.side(sign), end.side(-sign)])
        _answer(axes, answer, SHARE.side(sign), (16.0 * sign, -9.0))
    for step in (*DOWNWARDS, MATCHED, NOT_MATCHED):
        _draw(axes, step)
    return sheet


def _draw(axes: Axes, step: Step) -> None:
    """Draw a box or a diamond with its words."""
    (x, y), (a, b) = step.at, step.half
    if step.question:
        corners = np.array([(x - a, y), (x, y - b), (x + a, y), (x, y + b)])
    else:
        corners = np.array([(x - a, y - b), (x + a, y - b), (x + a, y + b), (x - a, y + b)])
    axes.fill(
        *corners.T,
        facecolor=hexadecimal(PAPER if step.question else BAND),
        edgecolor=hexadecimal(step.edge),
        linewidth=1.6 * POINTS_PER_PX,
        zorder=LINES,
    )
    first = y - LINE_HEIGHT * (len(step.words) - 1) / 2
    for n, words in enumerate(step.words):
        label(axes, (x, first + n * LINE_HEIGHT), words, size=LABEL_SIZE)


def _path(axes: Axes, points: list[Place]) -> None:
    line(axes, points, TEXT_MUTED, OUTLINE - 0.6, layer=1.0)


def _arrow(axes: Axes, points: list[Place]) -> None:
    """Draw a line through points, and a head at its end."""
    _path(axes, points)
    end = np.array(points[-1])
    way = end - points[-2]
    way = way / np.hypot(*way)
    half, length = HEAD
    across, neck = np.array([-way[1], way[0]]), end - length * way
    corners = np.array([end, neck + half * across, neck - half * across])
    axes.fill(*corners.T, facecolor=hexadecimal(TEXT_MUTED), edgecolor="none", zorder=LINES)


def _answer(axes: Axes, word: str, at: Place, off: Place) -> None:
    """Write yes or no beside where an arrow leaves a question."""
    label(axes, (at[0] + off[0], at[1] + off[1]), word, size=LABEL_SIZE, colour=TEXT)
