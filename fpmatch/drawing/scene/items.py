"""The items of a page, before they become pixels or vectors, and their places on it.

Page coordinates are continuous: x to the right, y down, the first pixel of the page covers 0 to 1,
so that its centre is at 0.5. Lengths are in page pixels. An item's `role` becomes its SVG class.

A matrix, 3 x 3, maps the pixels of a print, counted at their centres from (0, 0), to page
coordinates.

Texts have one font, the scalable one that comes inside Pillow.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING, Final, Literal, NamedTuple, TypeAlias, cast

import numpy as np
from PIL import ImageFont

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray
    from PIL.ImageFont import FreeTypeFont

    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.pointset.geometry.similarity import Similarity

    Matrix = NDArray[np.float64]

Point: TypeAlias = tuple[float, float]
Anchor: TypeAlias = Literal["start", "middle", "end"]
_FAR: Final = 1e7  # page pixels; beyond it nothing is drawn, and integers must not overflow
_font = cast("Callable[[float], FreeTypeFont]", lru_cache(maxsize=32)(ImageFont.load_default))
_SPELLINGS: Final = str.maketrans(
    {"−": "-", "–": "-", "—": "-", "×": "x", "≥": ">=", "≤": "<=", "→": "->", "≈": "~"}
    | {"θ": "theta"}
)
_SQUARED_SIZE, _SQUARED_RISE = 0.6, 0.36  # of the size of the text


class Box(NamedTuple):
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

    def overlap(self, other: Box) -> float:
        """Return the area that both boxes cover."""
        width = min(self.right, other.right) - max(self.x, other.x)
        height = min(self.bottom, other.bottom) - max(self.y, other.y)
        return max(width, 0.0) * max(height, 0.0)


class Pen(NamedTuple):
    """The line and the fill of a shape."""

    stroke: Colour | None = None  # of the line
    fill: Colour | None = None  # of the inside
    width: float = 1.0
    opacity: float = 1.0  # of line and inside together
    halo: float = 0.0  # width of white around the line, on the ridges beneath
    dash: tuple[float, float] | None = None  # lengths of the dashes and of the gaps


class Path(NamedTuple):
    """Draw straight lines through `points`, back to the first where `closed`."""

    points: tuple[Point, ...]
    pen: Pen
    closed: bool = False
    role: str = ""


class Circle(NamedTuple):
    """Draw a circle."""

    centre: Point
    radius: float
    pen: Pen
    role: str = ""


class Text(NamedTuple):
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


class Ink(NamedTuple):
    """Multiply the page beneath by `colour`, as a printing ink does.

    Where two inks cover, their colours mix to a dark one.
    `coverage` (uint8, shape (H, W)) is 0 where the paper stays bare and 255 where the ink is full;
    `matrix` (shape (3, 3)) maps its pixels, counted at their centres, to page coordinates.
    """

    coverage: NDArray[np.uint8]
    colour: Colour
    matrix: NDArray[np.float64]
    role: str = ""


class Group(NamedTuple):
    """Draw `items` in order, and only inside `clip`."""

    items: tuple[Item, ...]
    clip: Box
    role: str = ""


Item: TypeAlias = Path | Circle | Text | Ink | Group


class Scene(NamedTuple):
    """A whole page: its size in pixels, its items in the order of drawing, its description.

    Pixels have the texts over everything else. `placed` has matrix and panel of probe and
    reference where a page shows them as they were taken.
    """

    width: int
    height: int
    items: tuple[Item, ...]
    description: str = ""
    placed: tuple[tuple[Matrix, Box], ...] = ()


def zoomed(zoom: float, origin: Point, to: Point) -> Matrix:
    """Return the matrix that magnifies by `zoom` and takes `origin` (in the print) to `to`."""
    x, y = to[0] - zoom * origin[0], to[1] - zoom * origin[1]
    return np.array([[zoom, 0.0, x], [0.0, zoom, y], [0.0, 0.0, 1.0]])


def of_transform(transform: Similarity) -> Matrix:
    """Return a similarity transform as a matrix."""
    return np.vstack([transform.matrix, [0.0, 0.0, 1.0]])


def moved(matrix: Matrix, points: ArrayLike) -> list[Point]:
    """Map `points` (shape (N, 2)) onto the page; coordinates are clipped to ±1e7 pixels."""
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    with np.errstate(over="ignore", invalid="ignore"):
        q = p @ matrix[:2, :2].T + matrix[:2, 2]
    q = np.clip(np.nan_to_num(q, nan=_FAR), -_FAR, _FAR)
    return [(x, y) for x, y in q.tolist()]


def directions(matrix: Matrix, angles: NDArray[np.floating]) -> list[Point]:
    """Return the unit vectors on the page of directions of minutiae, in radians, y up."""
    turned = np.column_stack([np.cos(angles), -np.sin(angles)]) @ matrix[:2, :2].T
    turned /= np.hypot(turned[:, :1], turned[:, 1:])
    return [(x, y) for x, y in turned.tolist()]


def bounds(points: list[Point]) -> Box:
    """Return the smallest box around `points`."""
    xs, ys = zip(*points, strict=True)
    return Box(min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys))


@lru_cache(maxsize=256)
def parts(text: str, size: float) -> list[tuple[str, FreeTypeFont, float, float]]:
    """Return `text` on one line in parts, as (letters, font, rise and width in pixels).

    Characters that the font lacks are spelled out where possible; ² is a raised 2.
    """
    line = " ".join(text.translate(_SPELLINGS).split())
    squared = ("2", _font(_SQUARED_SIZE * size), _SQUARED_RISE * size)
    pieces = filter(None, re.split("(²)", line))
    fonts = [squared if letters == "²" else (letters, _font(size), 0.0) for letters in pieces]
    return [(*part, float(part[1].getlength(part[0]))) for part in fonts]


def text_width(text: str, size: float) -> float:
    """Return the width of `text` in pixels at `size`."""
    return sum(width for *_, width in parts(text, size))


def wrapped(text: str, size: float, width: float) -> list[str]:
    """Break `text` between words into lines no wider than `width` where its words allow it."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines
