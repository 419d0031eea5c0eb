"""The items of a page, before they become pixels or vectors.

Page coordinates are continuous: x to the right, y down, the first pixel of the page covers 0 to 1,
so that its centre is at 0.5. Lengths are in page pixels. An item's `role` becomes its SVG class,
its `title` the text that a viewer shows on hovering.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from fpmatch.drawing.scene.palette import PAPER, Colour

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Point: TypeAlias = tuple[float, float]
Anchor: TypeAlias = Literal["start", "middle", "end"]


@dataclass(frozen=True, slots=True)
class Box:
    """An upright rectangle: its top-left corner and its size, not negative."""

    x: float
    y: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """The x of the right edge."""
        return self.x + self.width

    @property
    def bottom(self) -> float:
        """The y of the bottom edge."""
        return self.y + self.height

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """Its four corners, clockwise from the top left."""
        x, y, right, bottom = self.x, self.y, self.right, self.bottom
        return (x, y), (right, y), (right, bottom), (x, bottom)

    def grown(self, margin: float) -> Box:
        """Return the box with `margin` added on every side."""
        width, height = self.width + 2 * margin, self.height + 2 * margin
        return Box(self.x - margin, self.y - margin, width, height)

    def intersection(self, other: Box) -> Box:
        """Return the part that both boxes cover; of size 0 where there is none."""
        x, y = max(self.x, other.x), max(self.y, other.y)
        right, bottom = min(self.right, other.right), min(self.bottom, other.bottom)
        return Box(x, y, max(right - x, 0.0), max(bottom - y, 0.0))

    def overlap(self, other: Box) -> float:
        """Return the area that both boxes cover."""
        both = self.intersection(other)
        return float(both.width * both.height)

    def contains(self, point: Point) -> bool:
        """Return whether `point` is in the box."""
        return self.x <= point[0] <= self.right and self.y <= point[1] <= self.bottom


@dataclass(frozen=True, slots=True)
class Pen:
    """The line and the fill of a shape."""

    stroke: Colour | None = None  # of the line
    fill: Colour | None = None  # of the inside
    width: float = 1.0
    opacity: float = 1.0  # of line and inside together
    halo: float = 0.0  # width of white around the line, on the ridges beneath
    dash: tuple[float, float] | None = None  # lengths of the dashes and of the gaps


@dataclass(frozen=True, slots=True)
class Path:
    """Draw straight lines through `points`, back to the first where `closed`."""

    points: tuple[Point, ...]
    pen: Pen
    closed: bool = False
    role: str = ""
    title: str = ""


@dataclass(frozen=True, slots=True)
class Circle:
    """Draw a circle."""

    centre: Point
    radius: float
    pen: Pen
    role: str = ""
    title: str = ""


@dataclass(frozen=True, slots=True)
class Text:
    """Write one line of `text`; (x, y) is the start, middle or end of its baseline."""

    x: float
    y: float
    text: str
    size: float
    colour: Colour
    anchor: Anchor = "start"
    bold: float = 0.0  # width of an outline that makes it heavier
    halo: float = 0.0  # and of the white around it
    role: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Ink:
    """Multiply the page beneath by `colour`, as a printing ink does.

    `coverage` (uint8, shape (H, W)) is 0 where the paper stays bare and 255 where the ink is full;
    `matrix` (shape (3, 3)) maps its pixels, counted at their centres, to page coordinates.
    """

    coverage: NDArray[np.uint8]
    colour: Colour
    matrix: NDArray[np.float64]
    role: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Overprint:
    """Print two inks over each other; where both cover, their colours mix to a dark one."""

    lower: Ink
    upper: Ink


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Draw `items` in order, and only inside `clip`."""

    items: tuple[Item, ...]
    clip: Box
    role: str = ""


Item: TypeAlias = Path | Circle | Text | Ink | Overprint | Group


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A whole page: its size in pixels, its items in the order of drawing, its description."""

    width: int
    height: int
    items: tuple[Item, ...]
    description: str = ""
    paper: Colour = PAPER
