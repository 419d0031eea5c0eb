"""The paper's Figure 7: its matching algorithm as a flow chart."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.drawing.paper_figures.marks import LINES, MESHES, label
from fpmatch.drawing.paper_figures.sheet import PX, Sheet
from fpmatch.drawing.scene.palette import (
    BAND,
    MATCH,
    NO_MATCH,
    PAPER,
    TEXT_MUTED,
    Colour,
    hexadecimal,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    Place = tuple[float, float]

HEIGHT: Final = 1002
LINE_HEIGHT: Final = 19.0
BOX_ROOM: Final = 16.0  # pixels above and below the text of a box, together
DIAMOND: Final = (300.0, 84.0)
LEFT, MIDDLE, RIGHT, RAIL = 78.0, 380.0, 650.0, 138.0  # from the left
BELOW, ON_THE_LEFT, ON_THE_RIGHT = (20.0, 10.0), (-16.0, -9.0), (16.0, -9.0)  # places of answers
CAPTION: Final = (
    "The algorithm as section 3.3 of the paper describes it: precomputation, then local matching "
    "of all combinations of a point p of P and a point q of Q, then global matching. The "
    "difference of the areas is compared with a threshold that the paper does not specify; ρ is "
    "the matching factor."
)


class Step(NamedTuple):
    """One box, or the diamond of a decision, which has no width of its own."""

    y: float
    text: str
    width: float | None = 330.0
    x: float = MIDDLE
    edge: Colour = TEXT_MUTED

    @property
    def half(self) -> Place:
        """Half its width and height."""
        if self.width is None:
            return DIAMOND[0] / 2, DIAMOND[1] / 2
        return self.width / 2, (LINE_HEIGHT * (self.text.count("\n") + 1) + BOX_ROOM) / 2

    def end(self, x: int, y: int) -> Place:
        """Return the middle of its left (-1, 0), right (1, 0), upper (0, -1) or lower side."""
        return self.x + x * self.half[0], self.y + y * self.half[1]


DOWNWARDS: Final = (
    Step(24, "Point sets P and Q", 200.0),
    Step(98, "Precomputation of P and of Q:\ntriangulation, unit-circle parametrization"),
    Step(176, "Next combination of p and q", 240.0),
    Step(262, "p and q\ninterior points?", None),
    Step(376, "As many edges\nat p as at q?", None),
    Step(474, "Local matching: one-ring polygons of\np and q on the unit circle, their areas"),
    Step(562, "Difference of areas\nbelow the threshold?", None),
    Step(660, "p and q match locally: transformation\nfactor (rotation, scale, translation)"),
    Step(748, "All combinations\nof p and q done?", None),
    Step(846, "Global matching: overlap P and Q\nby the transformation factor"),
    Step(934, "Share of matching\npoints above ρ?", None),
)
_, _, COMBINATION, INTERIOR, DEGREE, _, THRESHOLD, _, ALL, _, SHARE = DOWNWARDS
MATCHED: Final = Step(934, "P and Q match;\ntime is recorded", 150.0, RIGHT, MATCH)
NOT_MATCHED: Final = Step(934, "P and Q do\nnot match", 130.0, LEFT, NO_MATCH)


def flow_chart() -> Sheet:
    """Draw Figure 7."""
    sheet = Sheet("Figure 7. The matching algorithm", CAPTION, ["a"], [HEIGHT])
    axes = sheet.panel("a", "Boxes are steps, diamonds decisions")
    axes.set(xlim=(0, axes.bbox.width), ylim=(HEIGHT, 0))
    for step in (*DOWNWARDS, MATCHED, NOT_MATCHED):
        _draw(axes, step)
    for above, below in pairwise(DOWNWARDS):
        answer = "yes" if above.width is None else ""
        _arrow(axes, [above.end(0, 1), below.end(0, -1)], answer, BELOW)
    again = COMBINATION.end(-1, 0)
    for step in (INTERIOR, DEGREE, THRESHOLD):  # whose "no" leads to the next combination
        start = step.end(-1, 0)
        _arrow(axes, [start, (RAIL, start[1]), (RAIL, again[1]), again], "no", ON_THE_LEFT)
    start, back = ALL.end(1, 0), COMBINATION.end(1, 0)
    _arrow(axes, [start, (RIGHT, start[1]), (RIGHT, back[1]), back], "no", ON_THE_RIGHT)
    _arrow(axes, [SHARE.end(1, 0), MATCHED.end(-1, 0)], "yes", ON_THE_RIGHT)
    _arrow(axes, [SHARE.end(-1, 0), NOT_MATCHED.end(1, 0)], "no", ON_THE_LEFT)
    return sheet


def _draw(axes: Axes, step: Step) -> None:
    """Draw a box or a diamond with its text."""
    (x, y), (a, b) = (step.x, step.y), step.half
    if step.width is None:
        corners = ((x - a, y), (x, y - b), (x + a, y), (x, y + b))
    else:
        corners = ((x - a, y - b), (x + a, y - b), (x + a, y + b), (x - a, y + b))
    face, edge = hexadecimal(PAPER if step.width is None else BAND), hexadecimal(step.edge)
    xs, ys = zip(*corners, strict=True)
    axes.fill(xs, ys, facecolor=face, edgecolor=edge, linewidth=1.6 * PX, zorder=LINES)
    lines = step.text.split("\n")
    for n, text in enumerate(lines):
        label(axes, (x, y + LINE_HEIGHT * (n - (len(lines) - 1) / 2)), text)


def _arrow(axes: Axes, points: list[Place], answer: str, beside: Place) -> None:
    """Draw a line through points, with a head at its end and an answer beside its start."""
    from matplotlib.patches import FancyArrowPatch  # noqa: PLC0415
    from matplotlib.path import Path  # noqa: PLC0415

    style, colour = "-|>,head_width=5,head_length=8", hexadecimal(TEXT_MUTED)
    axes.add_patch(
        FancyArrowPatch(
            path=Path(points), arrowstyle=style, color=colour, linewidth=1.6 * PX,
            mutation_scale=1, joinstyle="miter", zorder=MESHES,
        )
    )  # fmt: skip
    if answer:
        label(axes, (points[0][0] + beside[0], points[0][1] + beside[1]), answer)
