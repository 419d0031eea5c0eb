"""P moved onto Q by what either matcher found: the paper's Figure 8 (b)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.drawing.case_study.case import FADED, names, show_box, show_pixels
from fpmatch.drawing.palette import PAIR_LINK, PROBE_INK, REFERENCE_INK
from fpmatch.drawing.paper_figures.marks import EDGE, TINTS, dots, segments
from fpmatch.drawing.paper_figures.sheet import Sheet
from fpmatch.drawing.paper_figures.words import degrees, number

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.drawing.case_study.case import Case
    from fpmatch.drawing.palette import Colour
    from fpmatch.matching.result import Verification

PANEL_HEIGHT: Final = 440
DOTS: Final = {"P": 5.0, "Q": 9.0}


def overlays(case: Case) -> Sheet:
    """Draw P over Q under the transform of either matcher."""
    found = " ".join(
        f"{name}: {_said(result)}" for name, result in zip(names(case), case.results, strict=True)
    )
    caption = (
        "P (blue, dots), moved by the similarity transform of eq. (1), over Q (orange, squares); "
        f"pairs are joined, hollow dots and lone squares have no partner. {found}"
    )
    sheet = Sheet("Figure 8. The match that was found", caption, 2, [PANEL_HEIGHT])
    for column, (name, result) in enumerate(zip(names(case), case.results, strict=True)):
        title = f"({'ab'[column]}) {name}: {len(result.pairs)} pairs"
        axes = sheet.panel(0, column, title)
        show_box(axes, case.reference.view)
        show_pixels(axes, _laid_over(case, result))
        p, q = case.probe.points, case.reference.points
        dots(axes, q, TINTS["Q"], DOTS["Q"], hollow=True)
        if result.transform is None:
            continue
        moved = result.transform.apply(p)
        i, j = result.pairs.T
        segments(axes, np.stack([moved[i], q[j]], axis=1), PAIR_LINK, 2 * EDGE)
        alone = np.setdiff1d(np.arange(len(p)), i)
        dots(axes, moved[i], TINTS["P"], DOTS["P"])
        dots(axes, moved[alone], TINTS["P"], DOTS["P"], hollow=True)
    return sheet


def _said(result: Verification) -> str:
    """Say what the transform is, in the words of the commands."""
    if result.transform is None:
        return "no transform found."
    t = result.transform
    sense = "clockwise" if t.rotation_deg >= 0 else "counter-clockwise"  # y points down
    return (
        f"rotation {degrees(abs(t.rotation_deg))} {sense}, scale {number(t.scale)}, shift "
        f"({number(t.tx, 0)}, {number(t.ty, 0)}) px, pairs {number(result.rms_px, 1)} px apart "
        "(rms)."
    )


def _laid_over(case: Case, result: Verification) -> NDArray[np.uint8]:
    """Return Q in orange ink, and P, moved, in blue over it, where there is a transform."""
    q = _inked(case.reference.pixels, REFERENCE_INK)
    if result.transform is None:
        return np.rint(q).astype(np.uint8)
    rows, columns = case.reference.pixels.shape
    matrix = np.asarray(result.transform.matrix, np.float64)
    moved = cv2.warpAffine(
        case.probe.pixels, matrix, (columns, rows), flags=cv2.INTER_LINEAR, borderValue=(255,)
    )
    p = _inked(np.asarray(moved, np.uint8), PROBE_INK)
    return np.rint(p * q / 255.0).astype(np.uint8)


def _inked(pixels: NDArray[np.uint8], ink: Colour) -> NDArray[np.float64]:
    """Return a print in one ink on white, faded, RGB."""
    share = 2 * FADED * (255.0 - pixels[..., None]) / 255.0
    return np.asarray(255.0 - share * (255.0 - np.array(ink, np.float64)))
