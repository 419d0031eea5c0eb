"""Write a scene as SVG: the inks as embedded pictures, everything else as vectors and text."""

from __future__ import annotations

import base64
import re
from itertools import count
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree

import cv2
import numpy as np

from fpmatch.drawing.files import png_bytes
from fpmatch.drawing.fonts import text_width
from fpmatch.drawing.palette import PAPER, hexadecimal, mixed
from fpmatch.drawing.scene.items import Circle, Group, Ink, Overprint, Path, Text

if TYPE_CHECKING:
    from collections.abc import Iterator
    from xml.etree.ElementTree import Element

    from fpmatch.drawing.scene.items import Box, Item, Pen, Scene

_NAMESPACE: Final = "http://www.w3.org/2000/svg"
_FONTS: Final = "Aileron, 'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', sans-serif"
_NOT_XML: Final = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_STYLE: Final = f"text{{font-family:{_FONTS}}}"


def svg_text(scene: Scene) -> str:
    """Write `scene` as the text of an SVG file.

    Not every viewer can multiply colours, so what two overprinted inks share becomes a third
    picture above them.

    Examples
    --------
    >>> from fpmatch.drawing.scene.items import Scene
    >>> svg_text(Scene(width=30, height=20, items=()))[:29]
    '<svg xmlns="http://www.w3.org'
    """
    root = ElementTree.Element(
        "svg",
        {
            "xmlns": _NAMESPACE,
            "width": str(scene.width),
            "height": str(scene.height),
            "viewBox": f"0 0 {scene.width} {scene.height}",
            "role": "img",
        },
    )
    ElementTree.SubElement(root, "title").text = _legal(scene.description)
    ElementTree.SubElement(root, "style").text = _STYLE
    paper = {"width": "100%", "height": "100%", "fill": hexadecimal(scene.paper)}
    ElementTree.SubElement(root, "rect", paper)
    _add_items(root, scene.items, count(1))
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_items(parent: Element, items: tuple[Item, ...], numbers: Iterator[int]) -> None:
    for item in items:
        if isinstance(item, Group):
            _add_items(_clipped_group(parent, item, next(numbers)), item.items, numbers)
        elif isinstance(item, Overprint):
            for ink in (item.lower, item.upper, shared_ink(item)):
                _add_ink(parent, ink)
        elif isinstance(item, Ink):
            _add_ink(parent, item)
        elif isinstance(item, Text):
            _add_text(parent, item)
        else:
            _add_shape(parent, item)


def _clipped_group(parent: Element, group: Group, number: int) -> Element:
    name = f"clip-{number}"
    clip = ElementTree.SubElement(parent, "clipPath", {"id": name})
    ElementTree.SubElement(clip, "rect", _rectangle(group.clip))
    attributes = {"clip-path": f"url(#{name})", **_class(group.role)}
    return ElementTree.SubElement(parent, "g", attributes)


def shared_ink(print_: Overprint) -> Ink:
    """Return where both inks of an overprint cover, in their mixed colour.

    Parameters
    ----------
    print_ : Overprint
        Two inks.

    Returns
    -------
    Ink
        Its coverage, in the pixels of the upper ink, is the product of both coverages.
    """
    lower, upper = print_.lower, print_.upper
    height, width = upper.coverage.shape
    lower_to_upper = (np.linalg.inv(upper.matrix) @ lower.matrix)[:2]
    beneath = cv2.warpAffine(
        lower.coverage, lower_to_upper, (width, height), flags=cv2.INTER_CUBIC, borderValue=0
    )
    both = np.rint(beneath.astype(np.float32) * upper.coverage / 255).astype(np.uint8)
    return Ink(both, mixed((lower.colour, upper.colour)), upper.matrix, "agreement")


def _add_ink(parent: Element, ink: Ink) -> None:
    height, width = ink.coverage.shape
    rgba = np.empty((height, width, 4), dtype=np.uint8)
    rgba[:, :, :3] = ink.colour
    rgba[:, :, 3] = ink.coverage
    data = base64.b64encode(png_bytes(rgba)).decode("ascii")
    (a, c, e), (b, d, f) = ink.matrix[:2].tolist()
    # An SVG image covers 0 to `width`; the ink's first pixel has its centre at 0.
    e, f = e - (a + c) / 2, f - (b + d) / 2
    ElementTree.SubElement(
        parent,
        "image",
        {
            **_class(ink.role),
            "width": str(width),
            "height": str(height),
            "transform": f"matrix({a:.8g} {b:.8g} {c:.8g} {d:.8g} {e:.8g} {f:.8g})",
            "href": f"data:image/png;base64,{data}",
        },
    )


def _add_text(parent: Element, text: Text) -> None:
    legal = _legal(" ".join(text.text.split()))
    attributes = {
        **_class(text.role),
        "x": _number(text.x),
        "y": _number(text.y),
        "font-size": _number(text.size),
        "fill": hexadecimal(text.colour),
        "text-anchor": text.anchor,
        "textLength": _number(text_width(legal, text.size)),
        "lengthAdjust": "spacingAndGlyphs",
    }
    if text.bold:
        attributes["font-weight"] = "600"
    if text.halo:
        attributes |= {
            "stroke": hexadecimal(PAPER),
            "stroke-width": _number(2 * text.halo),
            "stroke-linejoin": "round",
            "paint-order": "stroke",
        }
    ElementTree.SubElement(parent, "text", attributes).text = legal


def _add_shape(parent: Element, shape: Path | Circle) -> None:
    pen = shape.pen
    tag, geometry = _geometry(shape)
    if pen.halo and pen.stroke:
        halo = {
            "class": "halo",
            "fill": "none",
            "stroke": hexadecimal(PAPER),
            "stroke-width": _number(pen.width + 2 * pen.halo),
            **_line_ends(pen),
        }
        ElementTree.SubElement(parent, tag, geometry | halo)
    attributes = {
        **_class(shape.role),
        "fill": hexadecimal(pen.fill) if pen.fill else "none",
        **_line_ends(pen),
    }
    if pen.stroke:
        attributes |= {"stroke": hexadecimal(pen.stroke), "stroke-width": _number(pen.width)}
    if pen.dash:
        attributes["stroke-dasharray"] = " ".join(map(_number, pen.dash))
    element = ElementTree.SubElement(parent, tag, geometry | attributes)
    if shape.title:
        ElementTree.SubElement(element, "title").text = _legal(shape.title)


def _geometry(shape: Path | Circle) -> tuple[str, dict[str, str]]:
    if isinstance(shape, Circle):
        x, y = shape.centre
        return "circle", {"cx": _number(x), "cy": _number(y), "r": _number(shape.radius)}
    if len(shape.points) == 2 and not shape.closed:
        (x1, y1), (x2, y2) = shape.points
        return "line", {
            "x1": _number(x1),
            "y1": _number(y1),
            "x2": _number(x2),
            "y2": _number(y2),
        }
    corners = " ".join(f"{_number(x)},{_number(y)}" for x, y in shape.points)
    return "polygon" if shape.closed else "polyline", {"points": corners}


def _line_ends(pen: Pen) -> dict[str, str]:
    ends = {"stroke-linecap": "round", "stroke-linejoin": "round"} if pen.stroke else {}
    return ends | ({"opacity": _number(pen.opacity)} if pen.opacity < 1 else {})


def _class(role: str) -> dict[str, str]:
    return {"class": role} if role else {}


def _rectangle(box: Box) -> dict[str, str]:
    return {
        "x": _number(box.x),
        "y": _number(box.y),
        "width": _number(box.width),
        "height": _number(box.height),
    }


def _number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _legal(text: str) -> str:
    """Replace the characters that XML 1.0 cannot hold."""
    return _NOT_XML.sub("\ufffd", text)
