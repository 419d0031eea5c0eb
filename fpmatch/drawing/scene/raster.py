"""Paint a scene into pixels.

A shape is drawn several times too large into a mask of its own bounding box and shrunk, which
gives the share of each pixel that it covers; its colour is then blended in by that share.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.drawing.fonts import font, printable
from fpmatch.drawing.palette import PAPER
from fpmatch.drawing.scene.items import Box, Circle, Group, Ink, Overprint, Path, Text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fpmatch.drawing.palette import Colour
    from fpmatch.drawing.scene.items import Anchor, Item, Pen, Point, Scene

_OVERSAMPLING: Final = 4
_SUBPIXEL_BITS: Final = 3  # cv2 takes coordinates as integers of 1/8 of a pixel
_PIL_ANCHORS: Final[dict[Anchor, str]] = {"start": "ls", "middle": "ms", "end": "rs"}


def paint(scene: Scene) -> NDArray[np.uint8]:
    """Paint `scene`; returns RGB, uint8, of shape (height, width, 3).

    Examples
    --------
    >>> from fpmatch.drawing.scene.items import Scene
    >>> paint(Scene(width=3, height=2, items=())).shape
    (2, 3, 3)
    """
    page = np.empty((scene.height, scene.width, 3), dtype=np.uint8)
    page[:] = scene.paper
    return paint_over(page, scene.items)


def paint_over(picture: NDArray[np.uint8], items: tuple[Item, ...]) -> NDArray[np.uint8]:
    """Return a copy of `picture` (RGB, uint8, shape (H, W, 3)) with `items` painted over it."""
    page = picture.astype(np.float32)
    height, width = picture.shape[:2]
    _paint_items(page, items, Box(0, 0, width, height))
    return np.rint(page).astype(np.uint8)


def _paint_items(page: NDArray[np.float32], items: tuple[Item, ...], clip: Box) -> None:
    for item in items:
        if isinstance(item, Group):
            _paint_items(page, item.items, _common(clip, item.clip))
        elif isinstance(item, Overprint):
            _paint_items(page, (item.lower, item.upper), clip)
        elif isinstance(item, Ink):
            _paint_ink(page, item, clip)
        elif isinstance(item, Text):
            _paint_text(page, item, clip)
        else:
            _paint_shape(page, item, clip)


def _paint_ink(page: NDArray[np.float32], ink: Ink, clip: Box) -> None:
    """Multiply the page by the ink's colour where it covers."""
    rows, columns = _pixels(clip)
    height, width = rows.stop - rows.start, columns.stop - columns.start
    if height <= 0 or width <= 0:
        return
    to_window = ink.matrix[:2].copy()
    to_window[:, 2] -= (columns.start + 0.5, rows.start + 0.5)
    coverage = cv2.warpAffine(
        ink.coverage, to_window, (width, height), flags=cv2.INTER_CUBIC, borderValue=0
    )
    share = coverage.astype(np.float32)[:, :, None] / 255
    page[rows, columns] *= 1 - share * (1 - np.asarray(ink.colour, dtype=np.float32) / 255)


def _paint_shape(page: NDArray[np.float32], shape: Path | Circle, clip: Box) -> None:
    pen = shape.pen
    if pen.halo and pen.stroke:
        _blend(page, _Mask.around(shape, clip).stroke(shape, pen.width + 2 * pen.halo), PAPER, pen)
    if pen.fill:
        _blend(page, _Mask.around(shape, clip).fill(shape), pen.fill, pen)
    if pen.stroke:
        _blend(page, _Mask.around(shape, clip).stroke(shape, pen.width), pen.stroke, pen)


def _blend(page: NDArray[np.float32], mask: _Mask, colour: Colour, pen: Pen) -> None:
    _blend_share(page, mask.rows, mask.columns, mask.share() * pen.opacity, colour)


def _blend_share(
    page: NDArray[np.float32],
    rows: slice,
    columns: slice,
    share: NDArray[np.float32],
    colour: Colour,
) -> None:
    window = page[rows, columns]
    window += share[:, :, None] * (np.asarray(colour, dtype=np.float32) - window)


def _paint_text(page: NDArray[np.float32], text: Text, clip: Box) -> None:
    if text.halo:
        _write(page, text, clip, PAPER, text.bold + text.halo)
    _write(page, text, clip, text.colour, text.bold)


def _write(page: NDArray[np.float32], text: Text, clip: Box, colour: Colour, stroke: float) -> None:
    from PIL import Image, ImageDraw  # noqa: PLC0415

    rows, columns = _pixels(clip)
    letters = printable(text.text)
    anchor = _PIL_ANCHORS[text.anchor]
    typeface = font(text.size)
    left, top, right, bottom = typeface.getbbox(letters, anchor=anchor, stroke_width=stroke)
    box = Box(text.x + left, text.y + top, right - left, bottom - top).grown(1)
    rows, columns = _pixels(_common(clip, box))
    height, width = rows.stop - rows.start, columns.stop - columns.start
    if height <= 0 or width <= 0 or not letters:
        return
    canvas = Image.new("L", (width, height))
    ImageDraw.Draw(canvas).text(
        (text.x - columns.start, text.y - rows.start),
        letters,
        fill=255,
        font=typeface,
        anchor=anchor,
        stroke_width=stroke,
    )
    share = np.asarray(canvas, dtype=np.float32) / np.float32(255)
    _blend_share(page, rows, columns, share, colour)


class _Mask:
    """Hold the oversampled coverage of a part of the page."""

    def __init__(self, window: Box) -> None:
        self.rows, self.columns = _pixels(window)
        height = max(self.rows.stop - self.rows.start, 0)
        width = max(self.columns.stop - self.columns.start, 0)
        self.cells = np.zeros((height * _OVERSAMPLING, width * _OVERSAMPLING), dtype=np.uint8)
        self.window = window

    @classmethod
    def around(cls, shape: Path | Circle, clip: Box) -> _Mask:
        """Return an empty mask that holds what is visible of `shape`."""
        if isinstance(shape, Circle):
            (x, y), r = shape.centre, shape.radius
            box = Box(x - r, y - r, 2 * r, 2 * r)
        else:
            xs, ys = zip(*shape.points, strict=True)
            box = Box(min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys))
        return cls(_common(clip, box.grown(shape.pen.width / 2 + shape.pen.halo + 1)))

    def share(self) -> NDArray[np.float32]:
        """Return the share of each pixel that is covered."""
        height, width = self.rows.stop - self.rows.start, self.columns.stop - self.columns.start
        if height <= 0 or width <= 0:
            return np.zeros((max(height, 0), max(width, 0)), dtype=np.float32)
        shrunk = cv2.resize(self.cells, (width, height), interpolation=cv2.INTER_AREA)
        return shrunk.astype(np.float32) / np.float32(255)

    def fill(self, shape: Path | Circle) -> _Mask:
        """Cover the inside of `shape`."""
        if self.cells.size:
            if isinstance(shape, Circle):
                self._disc(shape.centre, shape.radius)
            else:
                corners = np.array([self._fixed(p) for p in shape.points], dtype=np.int32)
                cv2.fillPoly(self.cells, [corners], 255, cv2.LINE_8, _SUBPIXEL_BITS)
        return self

    def stroke(self, shape: Path | Circle, width: float) -> _Mask:
        """Cover the line of `shape`."""
        if not self.cells.size:
            return self
        if isinstance(shape, Circle):
            self._disc(shape.centre, shape.radius + width / 2)
            self._disc(shape.centre, shape.radius - width / 2, 0)
            return self
        thickness = max(round(width * _OVERSAMPLING), 1)
        visible = self.window.grown(width)
        for start, end in _dashes(shape, visible):
            cv2.line(
                self.cells,
                self._fixed(start),
                self._fixed(end),
                255,
                thickness,
                cv2.LINE_8,
                _SUBPIXEL_BITS,
            )
        return self

    def _disc(self, centre: Point, radius: float, value: int = 255) -> None:
        if radius > 0:
            # cv2 covers half a cell more than the radius it is given.
            fixed = max(round((radius * _OVERSAMPLING - 0.5) * 2**_SUBPIXEL_BITS), 0)
            cv2.circle(
                self.cells,
                self._fixed(centre),
                fixed,
                value,
                cv2.FILLED,
                cv2.LINE_8,
                _SUBPIXEL_BITS,
            )

    def _fixed(self, point: Point) -> tuple[int, int]:
        """Return `point` in fractions of the cells, counted at their centres."""
        unit = 2**_SUBPIXEL_BITS
        return (
            round(((point[0] - self.columns.start) * _OVERSAMPLING - 0.5) * unit),
            round(((point[1] - self.rows.start) * _OVERSAMPLING - 0.5) * unit),
        )


def _dashes(path: Path, visible: Box) -> Iterator[tuple[Point, Point]]:
    """Yield the visible straight pieces of a path's line."""
    corners = path.points + path.points[:1] if path.closed else path.points
    for start, end in pairwise(corners):
        piece = clipped(start, end, visible)
        if piece is None:
            continue
        if path.pen.dash is None:
            yield piece
        else:
            yield from _cut(*piece, *path.pen.dash)


def _cut(start: Point, end: Point, dash: float, gap: float) -> Iterator[tuple[Point, Point]]:
    """Yield the dashes of one straight line."""
    length = math.dist(start, end)
    if length == 0:
        return
    dx, dy = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    for from_ in np.arange(0.0, length, dash + gap):
        to = min(from_ + dash, length)
        yield (
            (start[0] + float(from_) * dx, start[1] + float(from_) * dy),
            (start[0] + float(to) * dx, start[1] + float(to) * dy),
        )


def clipped(start: Point, end: Point, box: Box) -> tuple[Point, Point] | None:
    """Return the part of a straight line inside `box`, or None (Liang and Barsky, 1984).

    Examples
    --------
    >>> clipped((-10.0, 1.0), (10.0, 1.0), Box(0, 0, 4, 4))
    ((0.0, 1.0), (4.0, 1.0))
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    enters, leaves = 0.0, 1.0
    for step, room in (
        (-dx, start[0] - box.x),
        (dx, box.right - start[0]),
        (-dy, start[1] - box.y),
        (dy, box.bottom - start[1]),
    ):
        if step == 0:
            if room < 0:
                return None
        elif step < 0:
            enters = max(enters, room / step)
        else:
            leaves = min(leaves, room / step)
    if enters > leaves:
        return None
    return (
        (start[0] + enters * dx, start[1] + enters * dy),
        (start[0] + leaves * dx, start[1] + leaves * dy),
    )


def _common(a: Box, b: Box) -> Box:
    x, y = max(a.x, b.x), max(a.y, b.y)
    return Box(x, y, max(min(a.right, b.right) - x, 0), max(min(a.bottom, b.bottom) - y, 0))


def _pixels(box: Box) -> tuple[slice, slice]:
    """Return the rows and columns of the page that `box`, inside the page, touches."""
    return (
        slice(math.floor(box.y), max(math.ceil(box.bottom), math.floor(box.y))),
        slice(math.floor(box.x), max(math.ceil(box.right), math.floor(box.x))),
    )
