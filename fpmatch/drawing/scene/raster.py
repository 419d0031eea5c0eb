"""Paint a scene into pixels, and encode pixels as the content of a file.

A shape is drawn four times too large into a mask of its own bounding box and shrunk, which gives
the share of each pixel that it covers. (OpenCV's own anti-aliased lines have widths of 1.4, 3.4,
5.4, ... pixels only.) Its colour is then blended in by that share.
"""

from __future__ import annotations

import base64
import math
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.drawing.scene.fonts import font, parts, text_width
from fpmatch.drawing.scene.items import Box, Circle, Group, Ink, Overprint, Path, Text, bounds
from fpmatch.drawing.scene.palette import PAPER
from fpmatch.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Anchor, Item, Point, Scene
    from fpmatch.drawing.scene.palette import Colour

    Page = NDArray[np.float32]
    Cell = tuple[int, int]

_OVERSAMPLING: Final = 4
_SUBPIXEL_BITS: Final = 3  # cv2 takes coordinates as integers of 1/8 of a pixel
_UNIT: Final = 2**_SUBPIXEL_BITS
_PIL_ANCHORS: Final[dict[Anchor, str]] = {"start": "ls", "middle": "ms", "end": "rs"}
_BEFORE: Final[dict[Anchor, float]] = {"start": 0.0, "middle": 0.5, "end": 1.0}  # of the width


def paint(scene: Scene) -> NDArray[np.uint8]:
    """Paint `scene`; returns RGB, uint8, of shape (height, width, 3)."""
    page = np.empty((scene.height, scene.width, 3), dtype=np.uint8)
    page[:] = scene.paper
    return paint_over(page, scene.items)


def paint_over(picture: NDArray[np.uint8], items: tuple[Item, ...]) -> NDArray[np.uint8]:
    """Return a copy of `picture` (RGB, uint8, shape (H, W, 3)) with `items` painted over it."""
    page = picture.astype(np.float32)
    height, width = picture.shape[:2]
    _paint_items(page, items, Box(0, 0, width, height))
    return np.rint(page).astype(np.uint8)


def _paint_items(page: Page, items: tuple[Item, ...], clip: Box) -> None:
    for item in items:
        if isinstance(item, Group):
            _paint_items(page, item.items, clip.intersection(item.clip))
        elif isinstance(item, Overprint):
            _paint_items(page, (item.lower, item.upper), clip)
        elif isinstance(item, Ink):
            _paint_ink(page, item, clip)
        elif isinstance(item, Text):
            texts = _parts(item)
            if item.halo:
                for text in texts:
                    _write(page, text, clip, PAPER, item.bold + item.halo)
            for text in texts:
                _write(page, text, clip, item.colour, item.bold)
        else:
            _paint_shape(page, item, clip)


def _pixels(box: Box) -> tuple[slice, slice]:
    """Return the rows and columns of the page that `box`, inside the page, touches."""
    top, left = math.floor(box.y), math.floor(box.x)
    bottom, right = max(math.ceil(box.bottom), top), max(math.ceil(box.right), left)
    return slice(top, bottom), slice(left, right)


def _blend(window: Page, share: Page, colour: Colour) -> None:
    window += share[:, :, None] * (np.asarray(colour, dtype=np.float32) - window)


def _paint_ink(page: Page, ink: Ink, clip: Box) -> None:
    """Multiply the page by the ink's colour where it covers."""
    rows, columns = _pixels(clip)
    size = (columns.stop - columns.start, rows.stop - rows.start)
    if not min(size):
        return
    to_window = ink.matrix[:2].copy()
    to_window[:, 2] -= (columns.start + 0.5, rows.start + 0.5)
    coverage = cv2.warpAffine(ink.coverage, to_window, size, flags=cv2.INTER_CUBIC, borderValue=0)
    share = coverage.astype(np.float32)[:, :, None] / 255
    page[rows, columns] *= 1 - share * (1 - np.asarray(ink.colour, dtype=np.float32) / 255)


def _parts(text: Text) -> list[Text]:
    """Return a text as the font writes it: in one part, or in several one after another."""
    pieces = parts(text.text, text.size)
    x, anchor = text.x, text.anchor
    if len(pieces) > 1:
        x, anchor = x - _BEFORE[anchor] * text_width(text.text, text.size), "start"
    placed = []
    for letters, size, rise in pieces:
        placed.append(replace(text, x=x, y=text.y - rise, text=letters, size=size, anchor=anchor))
        x += font(size).getlength(letters)
    return placed


def _write(page: Page, text: Text, clip: Box, colour: Colour, stroke: float) -> None:
    """Write a text with an outline of width `stroke`."""
    from PIL import Image, ImageDraw  # noqa: PLC0415

    letters, anchor, typeface = text.text, _PIL_ANCHORS[text.anchor], font(text.size)
    left, top, right, bottom = typeface.getbbox(letters, anchor=anchor, stroke_width=stroke)
    box = Box(text.x + left, text.y + top, right - left, bottom - top).grown(1)
    rows, columns = _pixels(clip.intersection(box))
    window = page[rows, columns]
    if not window.size:
        return
    mask = Image.new("L", (window.shape[1], window.shape[0]))
    start = text.x - columns.start, text.y - rows.start
    style: dict[str, Any] = {"font": typeface, "anchor": anchor, "stroke_width": stroke}
    ImageDraw.Draw(mask).text(start, letters, fill=255, **style)
    _blend(window, np.asarray(mask, dtype=np.float32) / np.float32(255), colour)


def _paint_shape(page: Page, shape: Path | Circle, clip: Box) -> None:
    pen = shape.pen
    if isinstance(shape, Path) and pen.dash:
        for dash in _dashes(shape, *pen.dash, clip):
            _paint_shape(page, dash, clip)
        return
    if isinstance(shape, Circle):
        box = Box(*shape.centre, 0, 0).grown(shape.radius)
    else:
        box = bounds(list(shape.points))
    rows, columns = _pixels(clip.intersection(box.grown(pen.width / 2 + pen.halo + 1)))
    window = page[rows, columns]
    if not window.size:
        return
    origin = (columns.start, rows.start)
    if pen.halo and pen.stroke:
        share = _covered(window, shape, origin, pen.width + 2 * pen.halo)
        _blend(window, share * pen.opacity, PAPER)
    if pen.fill:
        _blend(window, _covered(window, shape, origin, None) * pen.opacity, pen.fill)
    if pen.stroke:
        _blend(window, _covered(window, shape, origin, pen.width) * pen.opacity, pen.stroke)


def _covered(window: Page, shape: Path | Circle, origin: Point, width: float | None) -> Page:
    """Return the share of each pixel that a line of this width, or None the inside, covers."""
    height, wide = window.shape[:2]
    cells = np.zeros((height * _OVERSAMPLING, wide * _OVERSAMPLING), dtype=np.uint8)
    if isinstance(shape, Circle):
        _disc(cells, _fixed(shape.centre, origin), shape.radius + (width or 0) / 2, 255)
        if width is not None:
            _disc(cells, _fixed(shape.centre, origin), shape.radius - width / 2, 0)
    elif width is None:
        corners = np.array([_fixed(point, origin) for point in shape.points], dtype=np.int32)
        cv2.fillPoly(cells, [corners], 255, cv2.LINE_8, _SUBPIXEL_BITS)
    else:
        thickness = max(round(width * _OVERSAMPLING), 1)
        for line in _lines(shape, Box(*origin, wide, height).grown(width)):
            start, end = (_fixed(point, origin) for point in line)
            cv2.line(cells, start, end, 255, thickness, cv2.LINE_8, _SUBPIXEL_BITS)
    shrunk = cv2.resize(cells, (wide, height), interpolation=cv2.INTER_AREA)
    return shrunk.astype(np.float32) / np.float32(255)


def _fixed(point: Point, origin: Point) -> Cell:
    """Return a point of the page in cv2's fractions of the cells, counted at their centres."""
    x, y = ((v - o) * _OVERSAMPLING - 0.5 for v, o in zip(point, origin, strict=True))
    return round(x * _UNIT), round(y * _UNIT)


def _disc(cells: NDArray[np.uint8], centre: Cell, radius: float, value: int) -> None:
    if radius > 0:
        # cv2 covers half a cell more than the radius it is given
        fixed = max(round((radius * _OVERSAMPLING - 0.5) * _UNIT), 0)
        cv2.circle(cells, centre, fixed, value, cv2.FILLED, cv2.LINE_8, _SUBPIXEL_BITS)


def _lines(path: Path, box: Box) -> Iterator[tuple[Point, Point]]:
    """Yield the parts of a path's straight lines inside `box`; coordinates are rounded."""
    scale = _OVERSAMPLING * _UNIT
    rectangle = [round(v * scale) for v in (box.x, box.y, box.width, box.height)]
    corners = [(round(x * scale), round(y * scale)) for x, y in path.points]
    for start, end in pairwise(corners + corners[:1] if path.closed else corners):
        inside, first, last = cv2.clipLine(rectangle, start, end)
        if inside:
            yield (first[0] / scale, first[1] / scale), (last[0] / scale, last[1] / scale)


def _dashes(path: Path, dash: float, gap: float, box: Box) -> Iterator[Path]:
    """Yield the visible dashes of a path."""
    pen = replace(path.pen, dash=None)
    for start, end in _lines(path, box.grown(pen.width)):
        length = math.dist(start, end)
        for begin in np.arange(0.0, length, dash + gap):
            shares = np.array([[begin], [min(begin + dash, length)]]) / length
            (x0, y0), (x1, y1) = (start + shares * np.subtract(end, start)).tolist()
            yield Path(((x0, y0), (x1, y1)), pen)


def png_bytes(picture: NDArray[np.uint8]) -> bytes:
    """Encode a picture, grey (H, W), RGB (H, W, 3) or RGBA (H, W, 4), as PNG."""
    return _encoded(picture, ".png", [])


def webp_bytes(picture: NDArray[np.uint8], quality: int = 80) -> bytes:
    """Encode a picture as WebP, which is lossy and much smaller, at a quality from 1 to 100."""
    return _encoded(picture, ".webp", [cv2.IMWRITE_WEBP_QUALITY, quality])


def data_url(content: bytes, kind: str) -> str:
    """Return a picture as a URL that contains it."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def reduced(picture: NDArray[np.uint8], *, width: int, height: int) -> NDArray[np.uint8]:
    """Return a picture made smaller, where it is larger, to fit into a width and a height."""
    rows, columns = picture.shape[:2]
    factor = min(width / columns, height / rows)
    if factor >= 1:
        return picture
    size = (max(round(columns * factor), 1), max(round(rows * factor), 1))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _encoded(picture: NDArray[np.uint8], suffix: str, options: list[int]) -> bytes:
    order = {3: cv2.COLOR_RGB2BGR, 4: cv2.COLOR_RGBA2BGRA}
    channels = picture.shape[2] if picture.ndim == 3 else 1
    stored = picture if channels == 1 else cv2.cvtColor(picture, order[channels])
    done, encoded = cv2.imencode(suffix, stored, options)
    if not done:
        size = f"{picture.shape[1]} x {picture.shape[0]}"
        raise OutputError(f"a picture of {size} has no {suffix[1:].upper()} form")
    return encoded.tobytes()
