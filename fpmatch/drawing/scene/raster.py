"""Paint a scene into pixels, and encode pixels as the content of a file.

Inks and shapes are drawn on a canvas of twice the page's size with OpenCV's antialiased edges, and
the canvas is shrunk to the page. Texts are then written over everything else.
"""

from __future__ import annotations

import base64
import math
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.drawing.scene.fonts import font, parts
from fpmatch.drawing.scene.ink import shrunk
from fpmatch.drawing.scene.items import Circle, Group, Ink, Overprint, Text
from fpmatch.drawing.scene.palette import PAPER
from fpmatch.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Anchor, Item, Path, Scene
    from fpmatch.drawing.scene.palette import Colour

    Line = tuple[complex, complex]  # its ends, x + iy in canvas pixels
    Picture = NDArray[np.uint8]
    Outlines = NDArray[np.complex128]  # x + iy in canvas pixels, a row for each outline

_ZOOM: Final = 2  # of the canvas
_SUBPIXEL_BITS: Final = 4  # OpenCV takes coordinates as integers of 1/16 of a pixel
_UNIT: Final = 2**_SUBPIXEL_BITS
_SPREAD: Final = 0.4  # canvas pixels: outlines are smaller by it, as antialiased edges lie outside
_CIRCLE: Final = np.exp(2j * np.pi * np.arange(48) / 48)
_HALF_CIRCLE: Final = np.exp(1j * np.linspace(-np.pi / 2, np.pi / 2, 7))  # around the end of a line
_ROUND_ENDS: Final = np.concatenate([-_HALF_CIRCLE, _HALF_CIRCLE])
_BEFORE: Final[dict[Anchor, float]] = {"start": 0.0, "middle": 0.5, "end": 1.0}  # of the width


def paint(scene: Scene) -> Picture:
    """Paint `scene`; returns RGB, uint8, of shape (height, width, 3)."""
    size = (scene.height * _ZOOM, scene.width * _ZOOM, 3)
    return _painted(np.full(size, PAPER[0], dtype=np.uint8), scene.items)


def paint_over(picture: Picture, items: tuple[Item, ...]) -> Picture:
    """Return a copy of `picture` (RGB, uint8, shape (H, W, 3)) with `items` painted over it."""
    return _painted(_enlarged(picture), items)


def _enlarged(picture: NDArray[Any]) -> Picture:
    size = (picture.shape[1] * _ZOOM, picture.shape[0] * _ZOOM)
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)


def _painted(canvas: Picture, items: tuple[Item, ...]) -> Picture:
    _draw(canvas, items, 0j)
    size = (canvas.shape[1] // _ZOOM, canvas.shape[0] // _ZOOM)
    page = np.asarray(cv2.resize(canvas, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    for text in _texts(items):
        if text.halo:
            _write(page, text, PAPER, text.bold + text.halo)
        _write(page, text, text.colour, text.bold)
    return page


def _draw(canvas: Picture, items: tuple[Item, ...], origin: complex) -> None:
    """Draw inks and shapes on a canvas whose corner is at `origin`, x + iy, of the page."""
    for item in items:
        if isinstance(item, Group):
            _draw_group(canvas, item, origin)
        elif isinstance(item, Overprint):
            _draw(canvas, (item.lower, item.upper), origin)
        elif isinstance(item, Ink):
            _print(canvas, item, origin)
        elif not isinstance(item, Text):
            _draw_shape(canvas, item, origin)


def _draw_group(canvas: Picture, group: Group, origin: complex) -> None:
    """Draw a group on the part of the canvas inside its clip, which is extended to whole pixels."""
    clip, x, y = group.clip, origin.real, origin.imag
    left, top = max(math.floor(clip.x - x), 0), max(math.floor(clip.y - y), 0)
    right, bottom = max(math.ceil(clip.right - x), 0), max(math.ceil(clip.bottom - y), 0)
    window = canvas[top * _ZOOM : bottom * _ZOOM, left * _ZOOM : right * _ZOOM]
    if window.size:
        _draw(window, group.items, origin + complex(left, top))


def _print(canvas: Picture, ink: Ink, origin: complex) -> None:
    """Multiply the canvas by the colour of an ink where it covers."""
    size = (canvas.shape[1] // _ZOOM, canvas.shape[0] // _ZOOM)
    to_window = ink.matrix[:2] - ((0, 0, origin.real + 0.5), (0, 0, origin.imag + 0.5))
    coverage = cv2.warpAffine(ink.coverage, to_window, size)
    left, top, width, height = cv2.boundingRect(coverage)
    if not width:
        return
    tints = np.rint(255 - np.outer(np.arange(256), 1 - np.asarray(ink.colour) / 255))
    inked = coverage[top : top + height, left : left + width]
    tinted = _enlarged(cv2.applyColorMap(inked, tints.astype(np.uint8)[:, None]))
    left, top = left * _ZOOM, top * _ZOOM
    window = canvas[top : top + tinted.shape[0], left : left + tinted.shape[1]]
    cv2.multiply(window, tinted, dst=window, scale=1 / 255)


def _draw_shape(canvas: Picture, shape: Path | Circle, origin: complex) -> None:
    """Draw the white around a shape's line, its inside, and its line."""
    pen, wide = shape.pen, shape.pen.width + 2 * shape.pen.halo
    corner = origin * _ZOOM + (0.5 + 0.5j)  # pixels are counted at their centres
    if isinstance(shape, Circle):
        centre, radius = complex(*shape.centre) * _ZOOM - corner, shape.radius * _ZOOM
        inside = centre + max(radius - _SPREAD, 0.0) * _CIRCLE
        line = partial(_ring, centre, radius)
    else:
        corners = [complex(*point) * _ZOOM - corner for point in shape.points]
        inside = np.array(corners)
        sides = pairwise(corners + corners[:1] if shape.closed else corners)
        line = partial(_strokes, _visible(canvas, sides, pen.dash, wide))
    if pen.halo and pen.stroke:
        _fill(canvas, line(wide), PAPER, pen.opacity)
    if pen.fill:
        _fill(canvas, inside[None, None], pen.fill, pen.opacity)
    if pen.stroke:
        _fill(canvas, line(pen.width), pen.stroke, pen.opacity)


def _fill(canvas: Picture, outlines: Outlines, colour: Colour, opacity: float) -> None:
    """Fill polygons; `outlines` has the shape (polygons, contours of each, points)."""
    if not outlines.size:
        return
    fixed = np.rint(outlines.view(np.float64) * _UNIT).astype(np.int32)
    polygons = fixed.reshape(*outlines.shape, 2)
    window = before = canvas
    if opacity < 1:
        corners = polygons.reshape(-1, 2) // _UNIT
        left, top = np.maximum(corners.min(axis=0) - 2, 0)
        right, bottom = np.maximum(corners.max(axis=0) + 3, 0)
        window = canvas[top:bottom, left:right]
        before = window.copy()
    for contours in polygons:
        cv2.fillPoly(canvas, contours, colour, cv2.LINE_AA, _SUBPIXEL_BITS)
    if opacity < 1 and window.size:
        cv2.addWeighted(window, opacity, before, 1 - opacity, 0, dst=window)


def _ring(centre: complex, radius: float, width: float) -> Outlines:
    """Return the outlines of the line of `width` page pixels around a circle."""
    half = max(width * _ZOOM / 2 - _SPREAD, 0.0)
    radii = np.maximum([[radius + half], [radius - half]], 0.0)
    return np.asarray((centre + radii * _CIRCLE)[None])


def _strokes(lines: list[Line], width: float) -> Outlines:
    """Return the outline of each straight line of `width` page pixels, with round ends."""
    half = max(width * _ZOOM / 2 - _SPREAD, 0.0)
    ends = np.array(lines, dtype=np.complex128).reshape(-1, 2)
    along = np.exp(1j * np.angle(ends[:, 1:] - ends[:, :1]))
    corners = np.repeat(ends, len(_ROUND_ENDS) // 2, axis=1)
    return np.asarray((corners + half * along * _ROUND_ENDS)[:, None])


def _visible(
    canvas: Picture, sides: Iterable[Line], dash: tuple[float, float] | None, width: float
) -> list[Line]:
    """Return the parts of a path's sides that lie on the canvas, cut into dashes if it has any."""
    height, wide = (length * _UNIT for length in canvas.shape[:2])
    margin = math.ceil(width) * _ZOOM * _UNIT
    box = (-margin, -margin, wide + 2 * margin, height + 2 * margin)
    visible: list[Line] = []
    for side in sides:
        fixed = [(round(z.real * _UNIT), round(z.imag * _UNIT)) for z in side]
        inside, *ends = cv2.clipLine(box, *fixed)
        start, end = (complex(*point) / _UNIT for point in ends)
        if inside and dash is None:
            visible.append((start, end))
        elif inside and dash is not None:
            length = abs(end - start)
            begins = np.arange(0.0, length, sum(dash) * _ZOOM)
            shares = np.stack([begins, np.minimum(begins + dash[0] * _ZOOM, length)]) / length
            visible += zip(*(start + shares * (end - start)).tolist(), strict=True)
    return visible


def _texts(items: tuple[Item, ...]) -> Iterator[Text]:
    for item in items:
        if isinstance(item, Group):
            yield from _texts(item.items)
        elif isinstance(item, Text):
            yield item


def _write(page: Picture, text: Text, colour: Colour, stroke: float) -> None:
    """Write a text, in the parts that the font needs, with an outline of width `stroke`."""
    from PIL import Image, ImageDraw  # noqa: PLC0415

    written = [(*part, font(part[1])) for part in parts(text.text, text.size)]
    lengths = [typeface.getlength(letters) for letters, *_, typeface in written]
    x, margin = text.x - _BEFORE[text.anchor] * sum(lengths), text.size / 2 + stroke
    left, right = (max(math.floor(v), 0) for v in (x - margin, x + sum(lengths) + margin))
    top, bottom = (max(math.floor(text.y + v), 0) for v in (-text.size - margin, margin))
    window = page[top:bottom, left:right]
    if not window.size:
        return
    image = Image.fromarray(window)
    pencil = ImageDraw.Draw(image)
    for (letters, _, rise, typeface), length in zip(written, lengths, strict=True):
        place = (x - left, text.y - rise - top)
        pencil.text(place, letters, colour, typeface, "ls", stroke_width=stroke)
        x += length
    window[:] = np.asarray(image)


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
    return shrunk(picture, min(width / picture.shape[1], height / picture.shape[0]))


def _encoded(picture: NDArray[np.uint8], suffix: str, options: list[int]) -> bytes:
    order = {3: cv2.COLOR_RGB2BGR, 4: cv2.COLOR_RGBA2BGRA}
    channels = picture.shape[2] if picture.ndim == 3 else 1
    stored = picture if channels == 1 else cv2.cvtColor(picture, order[channels])
    done, encoded = cv2.imencode(suffix, stored, options)
    if not done:
        size = f"{picture.shape[1]} x {picture.shape[0]}"
        raise OutputError(f"a picture of {size} has no {suffix[1:].upper()} form")
    return encoded.tobytes()
