"""Paint a scene into pixels, and encode pixels as the content of a file.

Inks and shapes are drawn on a canvas of twice the page's size with OpenCV's antialiased edges, and
the canvas is shrunk to the page. Texts are then written over everything else.
"""

from __future__ import annotations

import base64
import math
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np
from PIL import Image, ImageDraw

from fpmatch.drawing.scene.ink import shrunk
from fpmatch.drawing.scene.items import Box, Circle, Group, Ink, Path, Text, parts, text_width
from fpmatch.drawing.scene.palette import PAPER
from fpmatch.errors import OutputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.items import Anchor, Scene

    Picture = NDArray[np.uint8]
    Outlines = NDArray[np.complex128]

_ZOOM: Final = 2  # of the canvas
_SUBPIXEL_BITS: Final = 4  # OpenCV takes coordinates as integers of 1/16 of a pixel
_UNIT: Final = 2**_SUBPIXEL_BITS
_SPREAD: Final = 0.4  # canvas pixels: outlines are smaller by it, as antialiased edges lie outside
_CIRCLE: Final = np.exp(2j * np.pi * np.arange(48) / 48)
_HALF_CIRCLE: Final = np.exp(1j * np.linspace(-np.pi / 2, np.pi / 2, 7))  # around the end of a line
_ROUND_ENDS: Final = np.concatenate([-_HALF_CIRCLE, _HALF_CIRCLE])
_BEFORE: Final[dict[Anchor, float]] = {"start": 0.0, "middle": 0.5, "end": 1.0}  # of the width


def paint(scene: Scene, beneath: Picture | None = None) -> Picture:
    """Paint a scene on white paper or over a picture.

    Parameters
    ----------
    scene : Scene
        What is painted.
    beneath : ndarray of uint8, shape (height, width, 3), optional
        The picture, RGB, of the scene's size.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        RGB.
    """
    if beneath is None:
        canvas = np.full((scene.height * _ZOOM, scene.width * _ZOOM, 3), PAPER[0], np.uint8)
    else:
        canvas = beneath.repeat(_ZOOM, axis=0).repeat(_ZOOM, axis=1)
    texts: list[Text] = []
    whole = Box(0, 0, scene.width, scene.height)
    for entry in scene.items:
        items, clip = (entry.items, entry.clip) if isinstance(entry, Group) else ((entry,), whole)
        # a group is drawn inside its clip, which is extended to whole pixels
        left, top = math.floor(clip.x), math.floor(clip.y)
        right, bottom = math.ceil(clip.right), math.ceil(clip.bottom)
        window = canvas[top * _ZOOM : bottom * _ZOOM, left * _ZOOM : right * _ZOOM]
        for item in items:
            if isinstance(item, Text):
                texts.append(item)
            elif isinstance(item, Ink):
                _print(window, item, complex(left, top))
            elif isinstance(item, Path | Circle):
                _draw_shape(window, item, complex(left, top))
    size = (scene.width, scene.height)
    page = np.asarray(cv2.resize(canvas, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    for text in texts:
        _write(page, text)
    return page


def _print(canvas: Picture, ink: Ink, origin: complex) -> None:
    """Multiply a canvas, whose corner is at `origin`, by the colour of an ink where it covers."""
    size = (canvas.shape[1] // _ZOOM, canvas.shape[0] // _ZOOM)
    to_window = ink.matrix[:2] - ((0, 0, origin.real + 0.5), (0, 0, origin.imag + 0.5))
    coverage = cv2.warpAffine(ink.coverage, to_window, size)
    left, top, width, height = cv2.boundingRect(coverage)
    if not width:
        return
    tints = np.rint(255 - np.outer(np.arange(256), 1 - np.asarray(ink.colour) / 255))
    inked = coverage[top : top + height, left : left + width]
    tinted = cv2.applyColorMap(inked, tints.astype(np.uint8)[:, None])
    size = (width * _ZOOM, height * _ZOOM)
    tinted = cv2.resize(tinted, size, interpolation=cv2.INTER_NEAREST)
    left, top = left * _ZOOM, top * _ZOOM
    window = canvas[top : top + size[1], left : left + size[0]]
    cv2.multiply(window, tinted, dst=window, scale=1 / 255)


def _draw_shape(canvas: Picture, shape: Path | Circle, origin: complex) -> None:
    """Draw the white around a shape's line, its inside, and its line."""
    pen, corner = shape.pen, origin * _ZOOM + (0.5 + 0.5j)  # pixels are counted at their centres
    if isinstance(shape, Circle):
        centre = complex(*shape.centre) * _ZOOM - corner
        points = centre + max(shape.radius * _ZOOM - _SPREAD, 0.0) * _CIRCLE
    else:
        points = np.array([complex(*point) for point in shape.points]) * _ZOOM - corner
    layers = [(points[None, None], pen.fill)] if pen.fill else []
    if pen.stroke:
        wide, line = _strokes(canvas, shape, points)
        layers = [(wide, PAPER)] * (pen.halo > 0) + [*layers, (line, pen.stroke)]
    fixed = [np.rint(outlines.view(np.float64) * _UNIT).astype(np.int32) for outlines, _ in layers]
    polygons = [f.reshape(*o.shape, 2) for f, (o, _) in zip(fixed, layers, strict=True)]
    window = before = canvas
    if pen.opacity < 1:
        corners = np.concatenate([p.reshape(-1, 2) for p in polygons]) // _UNIT
        left, top = np.maximum(corners.min(axis=0, initial=2**30) - 2, 0)
        right, bottom = np.maximum(corners.max(axis=0, initial=0) + 3, 0)
        window = canvas[top:bottom, left:right]
        before = window.copy()
    for outlines, (_, colour) in zip(polygons, layers, strict=True):
        for contours in outlines:
            cv2.fillPoly(canvas, contours, colour, cv2.LINE_AA, _SUBPIXEL_BITS)
    if pen.opacity < 1 and window.size:
        cv2.addWeighted(window, pen.opacity, before, 1 - pen.opacity, 0, dst=window)


def _strokes(canvas: Picture, shape: Path | Circle, points: Outlines) -> list[Outlines]:
    """Return the outlines of the line around a shape, with its halo and without.

    The corners of a path are at `points`. Outlines are x + iy in canvas pixels, of shape
    (polygons, contours of each, points): the ring of a circle, or each side with round ends.
    """
    pen = shape.pen
    widths = pen.width + 2 * pen.halo, pen.width
    halves = [max(width * _ZOOM / 2 - _SPREAD, 0.0) for width in widths]
    if isinstance(shape, Circle):
        radii = [np.maximum(shape.radius * _ZOOM + np.array([[h], [-h]]), 0.0) for h in halves]
        return [(points.mean() + r * _CIRCLE)[None] for r in radii]
    ends = _visible(canvas, shape, points)
    along = np.exp(1j * np.angle(ends[:, 1:] - ends[:, :1]))
    corners = np.repeat(ends, len(_ROUND_ENDS) // 2, axis=1)
    return [(corners + half * along * _ROUND_ENDS)[:, None] for half in halves]


def _visible(canvas: Picture, path: Path, points: Outlines) -> Outlines:
    """Return the ends, (N, 2), of a path's sides on the canvas, cut into dashes if it has any."""
    pen = path.pen
    height, width = (length * _UNIT for length in canvas.shape[:2])
    margin = math.ceil(pen.width + 2 * pen.halo) * _ZOOM * _UNIT
    box = (-margin, -margin, width + 2 * margin, height + 2 * margin)
    corners = np.rint(points.view(np.float64).reshape(-1, 2) * _UNIT).astype(int).tolist()
    visible: list[tuple[complex, complex]] = []
    for side in pairwise(corners + corners[:1] if path.closed else corners):
        inside, *ends = cv2.clipLine(box, *side)
        start, end = (complex(*point) / _UNIT for point in ends)
        if inside and pen.dash is None:
            visible.append((start, end))
        elif inside and pen.dash is not None:
            length = abs(end - start)
            begins = np.arange(0.0, length, sum(pen.dash) * _ZOOM)
            shares = np.stack([begins, np.minimum(begins + pen.dash[0] * _ZOOM, length)]) / length
            visible += zip(*(start + shares * (end - start)).tolist(), strict=True)
    return np.array(visible, dtype=np.complex128).reshape(-1, 2)


def _write(page: Picture, text: Text) -> None:
    """Write a text, in the parts that the font needs, over the white around it."""
    width, margin = text_width(text.text, text.size), text.size / 2 + text.bold + text.halo
    x = text.x - _BEFORE[text.anchor] * width
    left, right = (max(math.floor(v), 0) for v in (x - margin, x + width + margin))
    top, bottom = (max(math.floor(text.y + v), 0) for v in (-text.size - margin, margin))
    window = page[top:bottom, left:right]
    if not window.size:
        return
    image = Image.fromarray(window)
    pencil = ImageDraw.Draw(image)
    layers = [(PAPER, text.bold + text.halo)] * (text.halo > 0) + [(text.colour, text.bold)]
    for colour, stroke in layers:
        start = x - left
        for letters, typeface, rise, length in parts(text.text, text.size):
            place = (start, text.y - rise - top)
            pencil.text(place, letters, colour, typeface, "ls", stroke_width=stroke)
            start += length
    window[:] = np.asarray(image)


def png_bytes(picture: Picture) -> bytes:
    """Encode a picture, grey (H, W), RGB (H, W, 3) or RGBA (H, W, 4), as PNG.

    Raises OutputError if it has no pixels.
    """
    order = {3: cv2.COLOR_RGB2BGR, 4: cv2.COLOR_RGBA2BGRA}
    if not picture.size:
        raise OutputError(f"a picture of {picture.shape} has no PNG form")
    stored = picture if picture.ndim == 2 else cv2.cvtColor(picture, order[picture.shape[2]])
    return cv2.imencode(".png", stored)[1].tobytes()


def webp_bytes(picture: Picture, quality: int = 80) -> bytes:
    """Encode a picture as WebP, which is lossy and much smaller, at a quality from 1 to 100."""
    stored = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR) if picture.ndim == 3 else picture
    return cv2.imencode(".webp", stored, (cv2.IMWRITE_WEBP_QUALITY, quality))[1].tobytes()


def data_url(content: bytes, kind: str) -> str:
    """Return a picture as a URL that contains it."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def reduced(picture: Picture, *, width: int, height: int) -> Picture:
    """Return a picture made smaller, where it is larger, to fit into a width and a height."""
    return shrunk(picture, min(width / picture.shape[1], height / picture.shape[0]))
