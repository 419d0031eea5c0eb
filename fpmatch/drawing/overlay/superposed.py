"""The page of an overlay: the probe moved onto the reference, in two inks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.drawing.overlay.legend import overlay_legend
from fpmatch.drawing.overlay.marks import (
    EDGES,
    PAIR_PEN,
    PAIRED,
    UNPAIRED,
    described,
    marks,
    unpaired,
)
from fpmatch.drawing.overlay.page import Print, comfortable_zoom, frame, ink_of, page
from fpmatch.drawing.palette import PROBE_INK, REFERENCE_INK
from fpmatch.drawing.scene.items import Box, Group, Item, Overprint, Path, Scene
from fpmatch.drawing.scene.placement import bounds, corners, moved, of_transform, zoomed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.matching.result import Verification
    from fpmatch.pointset.similarity import Similarity

    Matrix = NDArray[np.float64]

_REACH: Final = 0.75  # of the reference's longer side: how far beyond it the probe is shown
_COMFORTABLE_SIDE: Final = 1000.0  # page pixels
_BORDER_PX: Final = 6.0  # reference pixels of paper around what is shown


def superposed_page(
    probe: Print, reference: Print, verification: Verification, transform: Similarity
) -> Scene:
    """Compose the page; `transform` maps the probe's pixels to the reference's."""
    probe_to_reference = of_transform(transform)
    view = _view(probe, reference, probe_to_reference)
    zoom = comfortable_zoom(max(view.width, view.height), _COMFORTABLE_SIDE)

    def panel(place: Box) -> list[Item]:
        to_page = zoomed(zoom, (view.x, view.y), (place.x, place.y))
        moving = to_page @ probe_to_reference
        inside: tuple[Item, ...] = (
            *inks(probe, reference, moving, to_page),
            _edge(reference, to_page, "reference"),
            _edge(probe, moving, "probe"),
            *minutiae_and_pairs(verification, moving, to_page, place),
        )
        return [Group(inside, place, "prints"), frame(place)]

    size = (round(view.width * zoom), round(view.height * zoom))
    return page(verification, size, panel, overlay_legend)


def _view(probe: Print, reference: Print, probe_to_reference: Matrix) -> Box:
    """Return the part of the reference's plane to show: both images, up to `_REACH`."""
    t = reference.template
    own = Box(-0.5, -0.5, t.width, t.height)
    other = bounds(moved(probe_to_reference, corners(probe.template.width, probe.template.height)))
    limit = own.grown(_REACH * max(own.width, own.height))
    both = bounds([*own.corners, *other.corners])
    return both.intersection(limit).grown(_BORDER_PX)


def inks(probe: Print, reference: Print, probe_to_page: Matrix, to_page: Matrix) -> list[Item]:
    """Return the ridges of both prints in their inks, without one that cannot be drawn."""
    lower = ink_of(reference, to_page, REFERENCE_INK, "reference ridges")
    upper = ink_of(probe, probe_to_page, PROBE_INK, "probe ridges")
    return [Overprint(lower, upper)] if lower and upper else [i for i in (lower, upper) if i]


def _edge(side: Print, matrix: Matrix, role: str) -> Path:
    outline = moved(matrix, corners(side.template.width, side.template.height))
    return Path(tuple(outline), EDGES[role], closed=True, role=f"{role} edge")


def minutiae_and_pairs(
    verification: Verification, probe_to_page: Matrix, to_page: Matrix, place: Box
) -> list[Item]:
    """Draw the unpaired minutiae, over them the pairs: reference, link, probe."""
    ours, theirs = verification.probe.minutiae, verification.reference.minutiae
    i, j = verification.pairs.reshape(-1, 2).T.tolist()
    starts, ends = moved(probe_to_page, ours.xy), moved(to_page, theirs.xy)
    titles = {
        b: f"pair {n}: probe {described(ours, a)}; reference {described(theirs, b)}"
        for n, (a, b) in enumerate(zip(i, j, strict=True), start=1)
    }
    links = [
        Path((starts[a], ends[b]), PAIR_PEN, role="pair", title=titles[b])
        for a, b in zip(i, j, strict=True)
        if place.contains(starts[a]) and place.contains(ends[b])
    ]
    return [
        *marks(theirs, unpaired(theirs, j), to_page, UNPAIRED["reference"], place),
        *marks(ours, unpaired(ours, i), probe_to_page, UNPAIRED["probe"], place),
        *marks(theirs, j, to_page, PAIRED["reference"], place, titles),
        *links,
        *marks(ours, i, probe_to_page, PAIRED["probe"], place),
    ]
