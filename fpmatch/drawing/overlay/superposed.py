"""The page of an overlay: the probe moved onto the reference, in two inks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.drawing.overlay.legend import PROBE_EDGE, REFERENCE_EDGE, overlay_legend
from fpmatch.drawing.overlay.marks import (
    PAIR_PEN,
    PROBE_PAIRED,
    PROBE_UNPAIRED,
    REFERENCE_PAIRED,
    REFERENCE_UNPAIRED,
    described,
    marks,
)
from fpmatch.drawing.overlay.page import Print, comfortable_zoom, frame, ink_of, page
from fpmatch.drawing.palette import PROBE_INK, REFERENCE_INK
from fpmatch.drawing.scene.items import Box, Group, Ink, Item, Overprint, Path, Pen, Scene
from fpmatch.drawing.scene.placement import bounds, corners, moved, of_transform, zoomed

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.matching.result import Verification
    from fpmatch.pointset.similarity import Similarity

_REACH: Final = 0.75  # of the reference's longer side: how far beyond it the view follows the probe
_COMFORTABLE_SIDE: Final = 1000.0  # page pixels
_BORDER_PX: Final = 6.0  # reference pixels of paper around what is shown


def superposed(
    probe: Print, reference: Print, verification: Verification, transform: Similarity
) -> Scene:
    """Compose the page on which the probe lies over the reference.

    Parameters
    ----------
    probe, reference : Print
        The two sides.
    verification : Verification
        Their comparison.
    transform : Similarity
        Its transform, from the probe's pixels to the reference's.

    Returns
    -------
    Scene
        The page.
    """
    probe_to_reference = of_transform(transform)
    view = _view(probe, reference, probe_to_reference)
    zoom = comfortable_zoom(max(view.width, view.height), _COMFORTABLE_SIDE)

    def panel(place: Box) -> list[Item]:
        reference_to_page = zoomed(zoom, (view.x, view.y), (place.x, place.y))
        probe_to_page = reference_to_page @ probe_to_reference
        inside: tuple[Item, ...] = (
            *_inks(probe, reference, probe_to_page, reference_to_page),
            _edge(reference, reference_to_page, REFERENCE_EDGE, "reference edge"),
            _edge(probe, probe_to_page, PROBE_EDGE, "probe edge"),
            *_minutiae(verification, probe_to_page, reference_to_page, place),
        )
        return [Group(inside, place, "prints"), frame(place)]

    size = (round(view.width * zoom), round(view.height * zoom))
    return page(verification, size, panel, overlay_legend)


def _view(probe: Print, reference: Print, probe_to_reference: NDArray[np.float64]) -> Box:
    """Return the part of the reference's plane to show: both images, within reason."""
    t = reference.template
    own = bounds([(-0.5, -0.5), (t.width - 0.5, t.height - 0.5)])
    other = bounds(moved(probe_to_reference, corners(probe.template.width, probe.template.height)))
    limit = own.grown(_REACH * max(own.width, own.height))
    left, top = max(min(own.x, other.x), limit.x), max(min(own.y, other.y), limit.y)
    right = min(max(own.right, other.right), limit.right)
    bottom = min(max(own.bottom, other.bottom), limit.bottom)
    return Box(left, top, right - left, bottom - top).grown(_BORDER_PX)


def _inks(
    probe: Print,
    reference: Print,
    probe_to_page: NDArray[np.float64],
    reference_to_page: NDArray[np.float64],
) -> tuple[Ink | Overprint, ...]:
    lower = ink_of(reference, reference_to_page, REFERENCE_INK, "reference ridges")
    upper = ink_of(probe, probe_to_page, PROBE_INK, "probe ridges")
    if lower and upper:
        return (Overprint(lower, upper),)
    return tuple(ink for ink in (lower, upper) if ink)


def _edge(side: Print, matrix: NDArray[np.float64], pen: Pen, role: str) -> Path:
    outline = moved(matrix, corners(side.template.width, side.template.height))
    return Path(tuple(outline), pen, closed=True, role=role)


def _minutiae(
    verification: Verification,
    probe_to_page: NDArray[np.float64],
    reference_to_page: NDArray[np.float64],
    place: Box,
) -> list[Item]:
    """Draw the unpaired minutiae, over them the pairs: reference, probe, and the line between."""
    ours, theirs = verification.probe.minutiae, verification.reference.minutiae
    pairs = [(int(i), int(j)) for i, j in verification.pairs.reshape(-1, 2)]
    probe_paired, reference_paired = [i for i, _ in pairs], [j for _, j in pairs]
    probe_rest = sorted(set(range(len(ours))) - set(probe_paired))
    reference_rest = sorted(set(range(len(theirs))) - set(reference_paired))
    from_, to = moved(probe_to_page, ours.xy), moved(reference_to_page, theirs.xy)
    titles = {
        j: f"pair {n}: probe {described(ours, i)}; reference {described(theirs, j)}"
        for n, (i, j) in enumerate(pairs, start=1)
    }
    links = [
        Path((from_[i], to[j]), PAIR_PEN, role="pair", title=titles[j])
        for i, j in pairs
        if place.holds(from_[i]) and place.holds(to[j])
    ]
    return [
        *marks(theirs, reference_rest, reference_to_page, REFERENCE_UNPAIRED, place),
        *marks(ours, probe_rest, probe_to_page, PROBE_UNPAIRED, place),
        *marks(theirs, reference_paired, reference_to_page, REFERENCE_PAIRED, place, titles),
        *links,
        *marks(ours, probe_paired, probe_to_page, PROBE_PAIRED, place),
    ]
