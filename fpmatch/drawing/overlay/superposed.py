"""The page of an overlay: the probe moved onto the reference, in two inks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.drawing.overlay.caption import header
from fpmatch.drawing.overlay.marks import (
    EDGES,
    KIND_SAMPLES,
    PAIR_PEN,
    PAIRED,
    UNPAIRED,
    described,
    mark_sample,
    marks,
    ridge_sample,
)
from fpmatch.drawing.overlay.page import SAMPLE_WIDTH, comfortable_zoom, frame, page
from fpmatch.drawing.scene.ink import ink_of
from fpmatch.drawing.scene.items import (
    Box,
    Group,
    Item,
    Path,
    Scene,
    bounds,
    moved,
    of_transform,
    zoomed,
)
from fpmatch.drawing.scene.palette import BOTH_INKS, PROBE_INK, REFERENCE_INK

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.drawing.overlay.page import Entry
    from fpmatch.drawing.scene.items import Matrix
    from fpmatch.matching.verification import Verification
    from fpmatch.pointset.geometry.similarity import Similarity

_REACH: Final = 0.75  # of the reference's longer side: how far beyond it the probe is shown
_COMFORTABLE_SIDE: Final = 1000.0  # page pixels
_BORDER_PX: Final = 6.0  # reference pixels of paper around what is shown
_LEGEND: Final[tuple[Entry, ...]] = (
    ridge_sample("reference ridges", REFERENCE_INK),
    ridge_sample("probe ridges, moved", PROBE_INK),
    ridge_sample("both together", BOTH_INKS),
    (
        "paired minutiae",
        (
            *mark_sample("", PAIRED["reference"], at=(9.0, 3.0))[1],
            *mark_sample("", PAIRED["probe"], at=(17.0, -3.0))[1],
            Path(((9.0, 3.0), (17.0, -3.0)), PAIR_PEN),
        ),
    ),
    mark_sample("unpaired, of reference", UNPAIRED["reference"]),
    mark_sample("unpaired, of probe", UNPAIRED["probe"]),
    *KIND_SAMPLES,
    ("edge of probe", (Path(((0.0, 0.0), (SAMPLE_WIDTH, 0.0)), EDGES["probe"]),)),
    ("edge of reference", (Path(((0.0, 0.0), (SAMPLE_WIDTH, 0.0)), EDGES["reference"]),)),
)


def superposed_page(
    images: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    verification: Verification,
    transform: Similarity,
) -> Scene:
    """Compose the page of `images`, probe and reference; `transform` maps probe to reference."""
    v, onto = verification, of_transform(transform)
    own = Box(-0.5, -0.5, v.reference.width, v.reference.height)
    outline = moved(onto, Box(-0.5, -0.5, v.probe.width, v.probe.height).corners)
    limit = own.grown(_REACH * max(own.width, own.height))
    near = np.clip(outline, (limit.x, limit.y), (limit.right, limit.bottom)).tolist()
    view = bounds([*own.corners, *((x, y) for x, y in near)]).grown(_BORDER_PX)
    zoom = comfortable_zoom(max(view.width, view.height), _COMFORTABLE_SIDE)
    size = (round(view.width * zoom), round(view.height * zoom))
    caption, place = header(v, size)
    to_page = zoomed(zoom, (view.x, view.y), (place.x, place.y))
    moving = to_page @ onto
    inside: tuple[Item, ...] = (
        *ink_of(images[1], v.reference, to_page, REFERENCE_INK, "reference ridges"),
        *ink_of(images[0], v.probe, moving, PROBE_INK, "probe ridges"),
        *(
            Path(tuple(moved(to_page, edge)), EDGES[side], closed=True, role=f"{side} edge")
            for side, edge in (("reference", own.corners), ("probe", outline))
        ),
        *minutiae_and_pairs(v, moving, to_page),
    )
    panel: list[Item] = [Group(inside, place, "prints"), frame(place)]
    return page(v, caption, panel, _LEGEND, place.bottom, (("reference", to_page, moving, place),))


def minutiae_and_pairs(verification: Verification, moving: Matrix, to_page: Matrix) -> list[Item]:
    """Draw the unpaired minutiae, over them the pairs: reference, link, probe.

    `moving` maps pixels of the probe to the page, `to_page` pixels of the reference.
    """
    ours, theirs = verification.probe.minutiae, verification.reference.minutiae
    i, j = verification.pairs.reshape(-1, 2).T.tolist()
    starts, ends = moved(moving, ours.xy), moved(to_page, theirs.xy)
    titles = {
        b: f"pair {n}: probe {described(ours, a)}; reference {described(theirs, b)}"
        for n, (a, b) in enumerate(zip(i, j, strict=True), start=1)
    }
    alone = [sorted({*range(len(m))}.difference(k)) for m, k in ((theirs, j), (ours, i))]
    return [
        *marks(theirs, alone[0], to_page, UNPAIRED["reference"]),
        *marks(ours, alone[1], moving, UNPAIRED["probe"]),
        *marks(theirs, j, to_page, PAIRED["reference"], titles),
        *(
            Path((starts[a], ends[b]), PAIR_PEN, role="pair", title=titles[b])
            for a, b in zip(i, j, strict=True)
        ),
        *marks(ours, i, moving, PAIRED["probe"]),
    ]
