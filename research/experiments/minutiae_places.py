"""Recall and precision of minutiae by place: at the border, at the core, faint and smeared.

A point is at none of these places, one or several. All but the core are measured in the image,
independently of the extraction: the print is where the local contrast is a quarter of its largest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.lab.evaluation.ground_truth.minutiae_counts import MAIN_TOLERANCE, assign_minutiae
from fpmatch.templates.minutiae import STANDARD_DPI
from research.markdown import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Minutiae

PLACES: Final = ("border", "core", "faint", "smeared", "elsewhere", "all")
"""The places, in the order of the table."""
# lengths in pixels at 500 dpi
WINDOW_PX: Final = 8.0  # standard deviation of the window of contrast and brightness
REACH: Final = 1.5  # standard deviations of the window by which contrast extends beyond the print
PRINT_CONTRAST: Final = 0.25  # least share of the largest contrast (95th percentile) in a print
CLOSING_PX: Final = 25  # width of gaps that belong to the print
BORDER_PX: Final = 24.0  # largest distance from the border
CORE_PX: Final = 64.0  # largest distance from a core
FAINT_CONTRAST: Final = 0.6  # share of the print's median contrast
SMEARED_BRIGHTNESS: Final = 0.3  # from ink (5th percentile) to paper (95th): filled valleys


@dataclass(frozen=True, slots=True)
class PlaceCounts:
    """Count the minutiae of one place; counts add up."""

    known: int = 0  # true minutiae that can be seen, or minutiae of another extractor
    found: int = 0  # known minutiae that were extracted
    extracted: int = 0  # extracted minutiae, but for true ones that cannot be seen
    right: int = 0  # extracted minutiae that are known

    def __add__(self, other: PlaceCounts) -> PlaceCounts:
        return PlaceCounts(
            self.known + other.known,
            self.found + other.found,
            self.extracted + other.extracted,
            self.right + other.right,
        )

    @property
    def recall(self) -> float:
        """Share of the known minutiae that were found; NaN where there are none."""
        return self.found / self.known if self.known else float("nan")

    @property
    def precision(self) -> float:
        """Share of the extracted minutiae that are known; NaN where there are none."""
        return self.right / self.extracted if self.extracted else float("nan")


def places_of(
    grey: NDArray[np.uint8],
    dpi: float,
    xy: NDArray[np.floating],
    cores: NDArray[np.floating] | None = None,
) -> dict[str, NDArray[np.bool_]]:
    """Return which points (N, 2) of an image lie in each of `PLACES`."""
    px = dpi / STANDARD_DPI
    window = WINDOW_PX * px
    image = grey.astype(np.float32)
    mean = cv2.GaussianBlur(image, (0, 0), window)
    variance = cv2.GaussianBlur(image * image, (0, 0), window) - mean * mean
    contrast = np.sqrt(np.maximum(variance, 0.0))
    of_print = (contrast >= PRINT_CONTRAST * np.percentile(contrast, 95)).astype(np.uint8)
    side = 2 * round(CLOSING_PX * px / 2) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    padded = cv2.copyMakeBorder(of_print, side, side, side, side, cv2.BORDER_CONSTANT)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, disc)
    inward = cv2.distanceTransform(closed, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    inward = inward[side:-side, side:-side] - REACH * window
    inside = closed[side:-side, side:-side] > 0
    some = inside if inside.any() else np.ones_like(inside)
    ink, paper = np.percentile(image, 5), np.percentile(image, 95)
    column, row = (
        np.clip(np.rint(axis).astype(np.intp), 0, length - 1)
        for axis, length in zip(xy.T, (grey.shape[1], grey.shape[0]), strict=True)
    )
    found = {
        "border": inward[row, column] <= BORDER_PX * px,
        "core": np.zeros(len(xy), bool),
        "faint": contrast[row, column] < FAINT_CONTRAST * np.median(contrast[some]),
        "smeared": mean[row, column] < ink + SMEARED_BRIGHTNESS * (paper - ink),
    }
    if cores is not None and len(cores):
        away = np.linalg.norm(xy[:, None].astype(np.float64) - cores[None], axis=2)
        found["core"] = away.min(axis=1) <= CORE_PX * px
    found["elsewhere"] = ~np.logical_or.reduce(list(found.values()))
    found["all"] = np.ones(len(xy), bool)
    return found


def count_by_place(
    extracted: Minutiae,
    known: Minutiae,
    visible: NDArray[np.bool_],
    places: tuple[Mapping[str, NDArray[np.bool_]], Mapping[str, NDArray[np.bool_]]],
) -> dict[str, PlaceCounts]:
    """Count extracted and known minutiae of one print in each place, given the places of both."""
    pairs = assign_minutiae(extracted, known, visible, MAIN_TOLERANCE)
    seen = visible[pairs[:, 1]]
    right = np.zeros(len(extracted), bool)
    counted = np.ones(len(extracted), bool)
    right[pairs[seen, 0]] = True
    counted[pairs[~seen, 0]] = False
    found = np.zeros(len(known), bool)
    found[pairs[seen, 1]] = True
    of_extracted, of_known = places
    return {
        place: PlaceCounts(
            int((of_known[place] & visible).sum()),
            int((of_known[place] & found).sum()),
            int((of_extracted[place] & counted).sum()),
            int((of_extracted[place] & right).sum()),
        )
        for place in PLACES
    }


def format_places(rows: Mapping[str, Mapping[str, Mapping[str, int]]]) -> str:
    """Return recall and precision in Markdown, of the counts by source of minutiae and place."""
    head = ["place"]
    for name in rows:
        head += [f"{name}: known", "recall", "precision"]
    cells = [head]
    for place in PLACES:
        line = [place]
        for counts in rows.values():
            one = PlaceCounts(**counts[place]) if place in counts else PlaceCounts()
            shares = (one.recall, one.precision)
            line += (
                [f"{one.known:,}", *(f"{100 * x:.1f} %" for x in shares)]
                if one.known
                else (["", "", ""])
            )
        if any(line[1:]):
            cells.append(line)
    return markdown_table(cells)
