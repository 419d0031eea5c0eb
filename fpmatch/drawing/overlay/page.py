"""The parts that every page shares: limits, prints as inks, and header, panel and legend."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from fpmatch.drawing.overlay.caption import MARGIN, header
from fpmatch.drawing.scene.ink import grey_pixels, ink_coverage, shrunk, thinned_off_print
from fpmatch.drawing.scene.items import (
    Box,
    Group,
    Ink,
    Item,
    Path,
    Pen,
    Scene,
    magnification,
    zoomed,
)
from fpmatch.drawing.scene.palette import PANEL_EDGE
from fpmatch.errors import ImageError
from fpmatch.printable import count
from fpmatch.prints.report import odds, outcome

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.scene.palette import Colour
    from fpmatch.matching.verification import Verification
    from fpmatch.templates.minutiae import Template

_LEAST_PAGE_WIDTH: Final = 800.0
_LARGEST_ZOOM: Final = 3.0
LARGEST_PANEL_SIDE: Final = 2000.0  # page pixels
_LARGEST_INK_SIDE: Final = 4000  # pixels of a print; a larger one is shrunk first
_FRAME_PEN: Final = Pen(PANEL_EDGE, width=1.0)
_MAGNIFICATIONS: Final = (1e-3, 1e3)  # outside, a print is a dot or one flat pixel: not drawn


@dataclass(frozen=True, slots=True, eq=False)
class Print:
    """One side of a comparison: its pixels (uint8, (H, W)) and its template."""

    pixels: NDArray[np.uint8]
    template: Template

    @property
    def box(self) -> Box:
        """The image as a box in its own pixels."""
        return Box(-0.5, -0.5, self.template.width, self.template.height)

    @classmethod
    def of(cls, name: str, image: Any, template: Template) -> Print:
        """Check that `image` is a grey image of its template's size, or raise an `ImageError`.

        Its message begins with `name`.
        """
        pixels = grey_pixels(name, image)
        height, width = pixels.shape
        if (width, height) != (template.width, template.height):
            raise ImageError(
                f"{name}: the image is {width} x {height} pixels, "
                f"but its template is of one of {template.width} x {template.height}"
            )
        return cls(pixels, template)


def comfortable_zoom(side: float, comfortable: float) -> float:
    """Return the magnification at which marks are crisp and the page fits a screen.

    A view whose longer `side`, in pixels of its print, is less than `comfortable` page pixels is
    magnified towards them; a larger one is shrunk only where it would exceed the largest panel.
    """
    zoom = min(max(comfortable / side, 1.0), _LARGEST_ZOOM)
    return min(zoom, LARGEST_PANEL_SIDE / side)


def ink_of(side: Print, matrix: NDArray[np.float64], colour: Colour, role: str) -> Ink | None:
    """Return a print as an ink placed by `matrix`, or None where it is too small or too large."""
    enlarged = magnification(matrix)
    low, high = _MAGNIFICATIONS
    if not low <= enlarged <= high:
        return None
    factor = min(enlarged, 1.0, _LARGEST_INK_SIDE / max(side.pixels.shape))
    coverage = ink_coverage(shrunk(side.pixels, factor), side.template.dpi * factor)
    if side.template.field is not None:
        coverage = thinned_off_print(coverage, side.template.field, factor)
    to_print = zoomed(1 / factor, (-0.5, -0.5), (-0.5, -0.5))
    return Ink(coverage, colour, matrix @ to_print, role)


def page(
    verification: Verification,
    panel_size: tuple[float, float],
    panel: Callable[[Box], list[Item]],
    legend: Callable[[float, float], tuple[list[Item], float]],
) -> Scene:
    """Compose a page: a header, a panel of `panel_size` (width, height) pixels, and a legend.

    `panel` returns the panel's items, given its place; `legend` returns the legend's items and its
    height, given the page's width and the legend's top.
    """
    v = verification
    panel_width, panel_height = panel_size
    width = max(_LEAST_PAGE_WIDTH, panel_width + 2 * MARGIN)
    head, head_height = header(v, width)
    place = Box((width - panel_width) // 2, math.ceil(head_height + 16), panel_width, panel_height)
    foot, foot_height = legend(width, place.bottom + 10)
    height = math.ceil(place.bottom + 10 + foot_height + 12)
    items: tuple[Item, ...] = (
        Group(tuple(head), Box(0, 0, width, head_height), "caption"),
        *panel(place),
        Group(tuple(foot), Box(0, place.bottom, width, height - place.bottom), "legend"),
    )
    rate = f"false match rate {odds(v.fmr)}, " if v.identical is None else ""
    description = (
        f"{outcome(v)}: score {v.score:.1f}, threshold {v.threshold:.1f}, {rate}"
        f"{count(len(v.pairs), 'pair')} of minutiae"
    )
    return Scene(math.ceil(width), height, items, description)


def panel_of(scene: Scene) -> Box:
    """Return the part of a page between caption and legend, the line around the panel included."""
    parts = {item.role: item.clip for item in scene.items if isinstance(item, Group)}
    top = parts["caption"].bottom
    return Box(0, top, scene.width, parts["legend"].y + 2 * _FRAME_PEN.width - top)


def frame(panel: Box) -> Path:
    """Draw the line around a panel, just outside it."""
    return Path(panel.grown(0.5).corners, _FRAME_PEN, closed=True)
