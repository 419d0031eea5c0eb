"""The page of the ridge agreement: the reference, its cells coloured by how well they agree."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.legend import ridge_legend
from fpmatch.drawing.overlay.marks import BESIDE_PAIRED, described, examiner_marks, marks
from fpmatch.drawing.overlay.page import Print, comfortable_zoom, frame, ink_of, page
from fpmatch.drawing.scene import palette
from fpmatch.drawing.scene.items import (
    Box,
    Group,
    Item,
    Path,
    Pen,
    Scene,
    bounds,
    moved,
    of_transform,
    zoomed,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.drawing.overlay.marks import ExaminerMark
    from fpmatch.matching.pipeline.ridge_map import RidgeMap
    from fpmatch.matching.result import Verification

_COMFORTABLE_SIDE: Final = 1000.0  # page pixels
_BORDER_PX: Final = 6.0  # reference pixels of paper around what is shown
_INK: Final[palette.Colour] = (70, 72, 76)


def ridge_page(
    reference: Print,
    verification: Verification,
    ridges: RidgeMap,
    own: Sequence[ExaminerMark] = (),
) -> Scene:
    """Compose the page of the reference with the cells of `ridges` and an examiner's marks."""
    t = reference.template
    shown = np.vstack([reference.box.corners, ridges.corners.reshape(-1, 2)])
    view = bounds(moved(np.eye(3), shown)).grown(_BORDER_PX)
    zoom = comfortable_zoom(max(view.width, view.height), _COMFORTABLE_SIDE)

    def panel(place: Box) -> list[Item]:
        to_page = zoomed(zoom, (view.x, view.y), (place.x, place.y))
        ink = ink_of(reference, to_page, _INK, "reference ridges")
        j = verification.pairs.reshape(-1, 2)[:, 1].tolist()
        titles = {
            b: f"pair {n}: reference {described(t.minutiae, b)}" for n, b in enumerate(j, start=1)
        }
        transform = verification.transform
        there = None if transform is None else to_page @ of_transform(transform)
        inside: tuple[Item, ...] = (
            *_cells(ridges, to_page),
            *((ink,) if ink else ()),
            *marks(t.minutiae, j, to_page, BESIDE_PAIRED["reference"], place, titles),
            *examiner_marks(own, "reference", to_page, there, place),
        )
        return [Group(inside, place, "ridge agreement"), frame(place)]

    size = (round(view.width * zoom), round(view.height * zoom))
    area = 0.0 if verification.compared is None else verification.compared.ridge_area_mm2
    legend = partial(ridge_legend, mean=ridges.mean, area_mm2=area)
    return page(verification, size, panel, legend)


def _cells(ridges: RidgeMap, to_page: NDArray[np.float64]) -> list[Item]:
    values = ridges.correlation[ridges.compared].tolist()
    items: list[Item] = []
    for corner, value in zip(ridges.corners, values, strict=True):
        colour = palette.agreement(value)
        points = tuple(moved(to_page, corner))
        title = f"ridge agreement {value:.2f}"
        items.append(Path(points, Pen(colour, colour), True, "cell", title))
    return items
