"""Write a scene as SVG: the inks as embedded pictures, everything else as vectors and text."""

from __future__ import annotations

import re
from itertools import count
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree

import numpy as np

from fpmatch.drawing.scene.items import Circle, Group, Ink, Text, text_width
from fpmatch.drawing.scene.palette import PAPER, hexadecimal
from fpmatch.drawing.scene.raster import data_url, png_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator
    from xml.etree.ElementTree import Element

    from fpmatch.drawing.scene.items import Item, Path, Scene

_FONTS: Final = "Aileron, 'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', sans-serif"
_NOT_XML: Final = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def svg_text(scene: Scene) -> str:
    """Write `scene` as the text of an SVG file, in which the viewer multiplies the inks."""
    size = {"width": str(scene.width), "height": str(scene.height)}
    view = {"viewBox": f"0 0 {scene.width} {scene.height}", "role": "img"}
    root = ElementTree.Element("svg", {"xmlns": "http://www.w3.org/2000/svg"} | size | view)
    ElementTree.SubElement(root, "title").text = _legal(scene.description)
    style = f"text{{font-family:{_FONTS}}}image{{mix-blend-mode:multiply}}"
    ElementTree.SubElement(root, "style").text = style
    _add(root, "rect", width="100%", height="100%", fill=hexadecimal(PAPER))
    _add_items(root, scene.items, count(1))
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _add(parent: Element, tag: str, **attributes: Any) -> Element:
    """Add an element; numbers are rounded, underscores become dashes, empty values are left out."""
    written = {
        name.rstrip("_").replace("_", "-"): value if isinstance(value, str) else _number(value)
        for name, value in attributes.items()
        if value != ""
    }
    return ElementTree.SubElement(parent, tag, written)


def _add_items(parent: Element, items: tuple[Item, ...], numbers: Iterator[int]) -> None:
    for item in items:
        if isinstance(item, Group):
            name, box = f"clip-{next(numbers)}", item.clip
            clip = _add(parent, "clipPath", id=name)
            _add(clip, "rect", x=box.x, y=box.y, width=box.width, height=box.height)
            group = _add(parent, "g", clip_path=f"url(#{name})", class_=item.role)
            _add_items(group, item.items, numbers)
        elif isinstance(item, Ink):
            _add_ink(parent, item)
        elif isinstance(item, Text):
            _add_text(parent, item)
        else:
            _add_shape(parent, item)


def _add_ink(parent: Element, ink: Ink) -> None:
    height, width = ink.coverage.shape
    rgba = np.empty((height, width, 4), dtype=np.uint8)
    rgba[:, :, :3] = ink.colour
    rgba[:, :, 3] = ink.coverage
    href = data_url(png_bytes(rgba), "png")
    (a, c, e), (b, d, f) = ink.matrix[:2].tolist()
    # An SVG image covers 0 to `width`; the ink's first pixel has its centre at 0.
    e, f = e - (a + c) / 2, f - (b + d) / 2
    matrix = f"matrix({a:.8g} {b:.8g} {c:.8g} {d:.8g} {e:.8g} {f:.8g})"
    size = {"width": width, "height": height}
    _add(parent, "image", class_=ink.role, **size, transform=matrix, href=href)


def _add_text(parent: Element, text: Text) -> None:
    legal = _legal(" ".join(text.text.split()))
    place = {"x": text.x, "y": text.y, "font_size": text.size}
    width = {"textLength": text_width(legal, text.size), "lengthAdjust": "spacingAndGlyphs"}
    style: dict[str, Any] = {"fill": hexadecimal(text.colour), "text_anchor": text.anchor, **width}
    style["font_weight"] = "600" if text.bold else ""
    if text.halo:
        style |= {"stroke": hexadecimal(PAPER), "stroke_width": 2 * text.halo}
        style |= {"stroke_linejoin": "round", "paint_order": "stroke"}
    _add(parent, "text", class_=text.role, **place, **style).text = legal


def _add_shape(parent: Element, shape: Path | Circle) -> None:
    pen = shape.pen
    tag, geometry = _geometry(shape)
    round_ = {"stroke_linecap": "round", "stroke_linejoin": "round"}
    ends: dict[str, Any] = round_ if pen.stroke else {}
    ends |= {"opacity": pen.opacity} if pen.opacity < 1 else {}
    if pen.halo and pen.stroke:
        wider, paper = pen.width + 2 * pen.halo, hexadecimal(PAPER)
        halo = {"class_": "halo", "fill": "none", "stroke": paper, "stroke_width": wider}
        _add(parent, tag, **geometry, **halo, **ends)
    style = {"class_": shape.role, "fill": hexadecimal(pen.fill) if pen.fill else "none"} | ends
    if pen.stroke:
        style |= {"stroke": hexadecimal(pen.stroke), "stroke_width": pen.width}
    if pen.dash:
        style["stroke_dasharray"] = " ".join(map(_number, pen.dash))
    _add(parent, tag, **geometry, **style)


def _geometry(shape: Path | Circle) -> tuple[str, dict[str, Any]]:
    if isinstance(shape, Circle):
        x, y = shape.centre
        return "circle", {"cx": x, "cy": y, "r": shape.radius}
    if len(shape.points) == 2 and not shape.closed:
        (x1, y1), (x2, y2) = shape.points
        return "line", {"x1": x1, "y1": y1, "x2": x2, "y2": y2}
    corners = " ".join(f"{_number(x)},{_number(y)}" for x, y in shape.points)
    return "polygon" if shape.closed else "polyline", {"points": corners}


def _number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _legal(text: str) -> str:
    """Replace the characters that XML 1.0 cannot hold."""
    return _NOT_XML.sub("\ufffd", text)
