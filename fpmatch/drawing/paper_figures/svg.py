"""What matplotlib's SVG lacks: a white rim around texts that stay texts."""

from __future__ import annotations

import copy
from typing import Final
from xml.etree import ElementTree

from fpmatch.drawing.paper_figures.text import POINTS_PER_PX

SVG: Final = "http://www.w3.org/2000/svg"
_PREFIXES: Final = {
    "": SVG,
    "xlink": "http://www.w3.org/1999/xlink",
    "rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#",
    "cc": "http://creativecommons.org/ns#",
    "dc": "http://purl.org/dc/elements/1.1/",
}


def with_rims(svg: bytes, label_ids: set[str], rim: str) -> bytes:
    """Put a copy with a wide outline beneath each label, which every viewer understands.

    Parameters
    ----------
    svg : bytes
        An SVG file by matplotlib.
    label_ids : set of str
        Ids of the groups whose texts get a rim.
    rim : str
        CSS of the copies.

    Returns
    -------
    bytes
        The SVG file, its width and height in pixels.
    """
    for prefix, uri in _PREFIXES.items():
        ElementTree.register_namespace(prefix, uri)
    root = ElementTree.fromstring(svg)
    for group in root.iter(f"{{{SVG}}}g"):
        if group.get("id") in label_ids:
            _add_rims(group, rim)
    for side, size in zip(("width", "height"), root.get("viewBox", "").split()[2:], strict=True):
        root.set(side, f"{float(size) / POINTS_PER_PX:g}")
    root.set("role", "img")
    written: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return written + b"\n"


def _add_rims(group: ElementTree.Element, rim: str) -> None:
    """Add the copies to the parents of all texts in `group`."""
    for parent in list(group.iter()):
        for place, text in reversed(list(enumerate(parent))):
            if text.tag == f"{{{SVG}}}text":
                beneath = copy.deepcopy(text)
                beneath.set("style", f"{text.get('style', '')}; {rim}".lstrip("; "))
                beneath.set("aria-hidden", "true")
                parent.insert(place, beneath)
