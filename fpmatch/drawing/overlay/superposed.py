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
    examiner_marks,
    marks,
    unpaired,
)
from fpmatch.drawing.overlay.page import Print, comfortable_zoom, frame, ink_of, page
from fpmatch.drawing.scene.items import (
    Box,
    Group,
    Item,
    Overprint,
    Path,
    Point,
    Scene,
    bounds,
    moved,
    of_transform,
    zoomed,
)
from fpmatch.drawing.scene.palette import PROBE_INK, REFERENCE_INK

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.drawing.overlay.marks import ExaminerMark
    from fpmatch.matching.verification import Verification
    from fpmatch.pointset.geometry.similarity import Similarity

    Matrix = NDArray[np.float64]

_REACH: Final = 0.75  # of the reference's longer side: how far beyond it the probe is shown
_COMFORTABLE_SIDE: Final = 1000.0  # page pixels
_BORDER_PX: Final = 6.0  # reference pixels of paper around what is shown


def superposed_page(
    probe: Print,
    reference: Print,
    verification: Verification,
    transform: Similarity,
    own: Sequence[ExaminerMark] = (),
) -> Scene:
    """Compose the page; `transform` maps the probe's pixels to the reference's."""
    probe_to_reference = of_transform(transform)
    outline = moved(probe_to_reference, probe.box.corners)
    view = view_of(reference, outline)
    zoom = comfortable_zoom(max(view.width, view.height), _COMFORTABLE_SIDE)

    def panel(place: Box) -> list[Item]:
        to_page = zoomed(zoom, (view.x, view.y), (place.x, place.y))
        moving = to_page @ probe_to_reference
        inside: tuple[Item, ...] = (
            *inks(probe, reference, moving, to_page),
            *(
                Path(tuple(moved(to_page, edge)), EDGES[side], closed=True, role=f"{side} edge")
                for side, edge in (("reference", reference.box.corners), ("probe", outline))
            ),
            *minutiae_and_pairs(verification, moving, to_page, place),
            *examiner_marks(own, "reference", to_page, moving, place),
        )
        return [Group(inside, place, "prints"), frame(place)]

    size = (round(view.width * zoom), round(view.height * zoom))
    return page(verification, size, panel, overlay_legend)


def view_of(reference: Print, outline: list[Point]) -> Box:
    """Return the part of the reference's plane to show: its image and an outline, to `_REACH`."""
    own = reference.box
    limit = own.grown(_REACH * max(own.width, own.height))
    both = bounds([*own.corners, *bounds(outline).corners])
    return both.intersection(limit).grown(_BORDER_PX)


def inks(
    probe: Print,
    reference: Print,
    probe_to_page: Matrix,
    to_page: Matrix,
) -> list[Item]:
    """Return the ridges of both prints in their inks, without one that cannot be drawn."""
    lower = ink_of(reference, to_page, REFERENCE_INK, "reference ridges")
    upper = ink_of(probe, probe_to_page, PROBE_INK, "probe ridges")
    return [Overprint(lower, upper)] if lower and upper else [i for i in (lower, upper) if i]


def minutiae_and_pairs(
    verification: Verification,
    probe_to_page: Matrix,
    to_page: Matrix,
    place: Box,
) -> list[Item]:
    """Draw the unpaired minutiae, over them the pairs: reference, link, probe."""
    ours, theirs = verification.probe.minutiae, verification.reference.minutiae
    i, j = verification.pairs.reshape(-1, 2).T.tolist()
    starts, ends = moved(probe_to_page, ours.xy), moved(to_page, theirs.xy)
    words = {a: described(ours, a) for a in range(len(ours))}
    titles = {
        b: f"pair {n}: probe {words[a]}; reference {described(theirs, b)}"
        for n, (a, b) in enumerate(zip(i, j, strict=True), start=1)
    }
    links = [
        Path((starts[a], ends[b]), PAIR_PEN, role="pair", title=titles[b])
        for a, b in zip(i, j, strict=True)
        if place.contains(starts[a]) and place.contains(ends[b])
    ]
    return [
        *marks(theirs, unpaired(theirs, j), to_page, UNPAIRED["reference"], place),
        *marks(ours, unpaired(ours, i), probe_to_page, UNPAIRED["probe"], place, words),
        *marks(theirs, j, to_page, PAIRED["reference"], place, titles),
        *links,
        *marks(ours, i, probe_to_page, PAIRED["probe"], place, words),
    ]
