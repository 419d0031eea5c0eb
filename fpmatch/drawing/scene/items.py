"""What a drawing is made of, before it becomes pixels or vectors.

Page coordinates are continuous: x to the right, y down, the first pixel of the page covers 0 to 1,
so that its centre lies at 0.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from fpmatch.drawing.palette import PAPER, Colour

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Point: TypeAlias = tuple[float, float]
Anchor: TypeAlias = Literal["start", "middle", "end"]


@dataclass(frozen=True, slots=True)
class Box:
    """Hold an upright rectangle of the page.

    Parameters
    ----------
    x, y : float
        Its top-left corner.
    width, height : float
        Its size, not negative.

    Examples
    --------
    >>> Box(0, 0, 10, 10).overlap(Box(5, 8, 10, 10))
    10.0
    """

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

    def grown(self, margin: float) -> Box:
        """Return the box with `margin` added on every side."""
        return Box(
            self.x - margin, self.y - margin, self.width + 2 * margin, self.height + 2 * margin
        )

    def overlap(self, other: Box) -> float:
        """Return the area that both boxes cover."""
        wide = min(self.right, other.right) - max(self.x, other.x)
        high = min(self.bottom, other.bottom) - max(self.y, other.y)
        return float(max(wide, 0.0) * max(high, 0.0))

    def holds(self, point: Point) -> bool:
        """Return whether `point` lies in the box."""
        return self.x <= point[0] <= self.right and self.y <= point[1] <= self.bottom


@dataclass(frozen=True, slots=True)
class Pen:
    """Hold how a shape is drawn; lengths in page pixels.

    Parameters
    ----------
    stroke, fill : Colour or None
        Colours of the line and of the inside; None leaves it out.
    width : float
        Width of the line.
    opacity : float
        0 (invisible) to 1 (opaque), of line and inside together.
    halo : float
        Width of white around the line, which keeps it apart from the ridges beneath.
    dash : tuple of two floats or None
        Lengths of the dashes and of the gaps; None draws through.
    """

    stroke: Colour | None = None
    fill: Colour | None = None
    width: float = 1.0
    opacity: float = 1.0
    halo: float = 0.0
    dash: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Path:
    """Draw straight lines through `points`, back to the first where `closed`.

    `role` becomes the SVG class, `title` the words that a viewer shows on hovering.
    """

    points: tuple[Point, ...]
    pen: Pen
    closed: bool = False
    role: str = ""
    title: str = ""


@dataclass(frozen=True, slots=True)
class Circle:
    """Draw a circle; `role` and `title` as in `Path`."""

    centre: Point
    radius: float
    pen: Pen
    role: str = ""
    title: str = ""


@dataclass(frozen=True, slots=True)
class Text:
    """Write one line; (x, y) is the start, middle or end of its baseline.

    `size` is the font's size in pixels, `bold` the width of an outline that makes it heavier.
    """

    x: float
    y: float
    text: str
    size: float
    colour: Colour
    anchor: Anchor = "start"
    bold: float = 0.0
    halo: float = 0.0
    role: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Ink:
    """Print a picture in one ink over whatever lies beneath, as a press would.

    Parameters
    ----------
    coverage : ndarray of uint8, shape (H, W)
        0 where the paper stays bare, 255 where the ink is full.
    colour : Colour
        The ink on white paper.
    matrix : ndarray of float64, shape (3, 3)
        Maps pixels of `coverage`, counted at their centres, to page coordinates.
    role : str
        The SVG class.
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
    """Hold a whole page: its size in pixels, its items in the order of drawing, its description."""

    width: int
    height: int
    items: tuple[Item, ...]
    description: str = ""
    paper: Colour = PAPER
