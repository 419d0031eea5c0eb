"""Whether a template shows a finger, and whether one finger can have its minutiae.

The directions of neighbouring minutiae follow the ridges, which bend smoothly, and lie along the
template's own ridge field. Templates that are composed to match many prints often do neither. Or
they give nearly all of the quality to a few minutiae, so that the others count for nothing where
they have no partner.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from fpmatch.templates.minutiae import CM_PER_INCH, MM_PER_INCH, STANDARD_DPI

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.templates.minutiae import Template

MIN_SOLIDITY: Final = 0.55  # share of the ridges' convex hull; .67 is the least of 1,218 prints
MAX_UNIFORMITY: Final = 0.97  # of ridges on more than ENOUGH_MM2; .94 is the most of those prints
ENOUGH_MM2: Final = 77.0  # of ridges, which bend on more; more skin adds nothing to a score
ENOUGH_MINUTIAE: Final = 40  # of a print whose neighbouring directions are compared
NEIGHBOURS: Final = 5
FADING_PX: Final = 40.0  # at 500 dpi: distance at which a neighbour counts 1/e
LEAST_COHERENCE: Final = 0.41  # mean cosine of twice the difference between neighbours
LEAST_ALONG: Final = 0.65  # mean cosine of twice the difference from the ridges
LEAST_INSIDE: Final = 0.8  # share of the minutiae that lie on ridges
ENOUGH_ON_RIDGES: Final = 10  # minutiae whose ridges are compared
LEAST_EVEN: Final = 0.4  # of the qualities, see `are_uneven`,
LEAST_EVEN_OF_FEW: Final = 0.55  # and where there are fewer minutiae than
FEW_MINUTIAE: Final = 16
USUAL_DPI: Final = (500, 508, 512, 569, 600, 1000)
CLOSE_MM: Final = 0.7  # median distance of nearest minutiae, mostly above 0.73 of an extractor
MOST_COMPARED: Final = 400  # minutiae with each other; of more, the best

NO_FINGER: Final = "no finger can have this template"
DISORDERED: Final = "neighbouring minutiae point in unrelated directions"
OFF_RIDGES: Final = "its minutiae do not lie along its own ridges"
UNEVEN: Final = "a few of its minutiae have nearly all of the quality"
_CORNERS: Final = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.int32)  # of a cell


def lacks_ridges(template: Template) -> str:
    """Return why a print does not show the ridges of a finger; "" where it does.

    The ridges of a finger lie together, and bend where there are many; what is taken for ridges in
    other pictures is scattered, or straight like the lines of a text.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> lacks_ridges(Template(Minutiae.empty(), width=300, height=300))
    'has no ridges'
    """
    field = template.field
    if field is None or not field.mask.any():
        return "" if len(template.minutiae) else "has no ridges"
    cells = field.mask.view(np.uint8)
    corners = cv2.convexHull(cv2.findNonZero(cells)) + _CORNERS
    hull = cv2.contourArea(cv2.convexHull(corners.reshape(-1, 2)))
    number = cv2.countNonZero(cells)
    if number / hull < MIN_SOLIDITY:
        return "has no ridges of a finger: they are scattered"
    twice = 2.0 * field.orientation[field.mask]
    uniformity = math.hypot(np.cos(twice).mean(), np.sin(twice).mean())  # 1 if all are parallel
    area_mm2 = number * (field.step * MM_PER_INCH / template.dpi) ** 2
    straight = area_mm2 > ENOUGH_MM2 and uniformity > MAX_UNIFORMITY
    return "has no ridges of a finger: they are straight" if straight else ""


def find_doubts(template: Template) -> tuple[str, ...]:
    """Return why no finger has a template, or not at its resolution; none for most prints.

    Where its resolution was probably confused, the template is judged at the one that is meant.
    """
    meant = dpi_meant(template) if template.field is None else None
    if meant is None:
        return tuple(filter(None, [why_no_finger(template)]))
    why = f"probably {meant} dpi, written as {meant} pixels a cm: its minutiae are too close"
    return f"{why} for {template.dpi:g}", *find_doubts(replace(template, dpi=float(meant)))


def dpi_meant(template: Template) -> int | None:
    """Return the dpi that were probably written as pixels per cm, None where nothing indicates it.

    Minutiae are then 2.54 times too close to each other.
    """
    per_cm, few = round(template.dpi / CM_PER_INCH), len(template.minutiae) < ENOUGH_ON_RIDGES
    if per_cm not in USUAL_DPI or few or template.field is not None:
        return None
    nearest = _distances(template.minutiae.best(MOST_COMPARED).xy).min(axis=1)
    close = float(np.median(nearest)) * MM_PER_INCH / template.dpi < CLOSE_MM
    return per_cm if close else None


def why_no_finger(template: Template) -> str:
    """Return why no finger can have a template; "" where nothing indicates it."""
    m, field = template.minutiae, template.field
    if field is not None and len(m) >= ENOUGH_ON_RIDGES:
        last_row, last_column = np.array(field.mask.shape) - 1
        row = np.clip(np.floor(m.y / field.step).astype(int), 0, last_row)
        column = np.clip(np.floor(m.x / field.step).astype(int), 0, last_column)
        on = field.mask[row, column]
        if lie_off_ridges(on, m.angle[on] - field.orientation[row, column][on]):
            return f"{NO_FINGER}: {OFF_RIDGES}"
    if len(m) >= ENOUGH_MINUTIAE:
        best = m.best(MOST_COMPARED)
        if _coherence(best.xy * (STANDARD_DPI / template.dpi), best.angle) < LEAST_COHERENCE:
            return f"{NO_FINGER}: {DISORDERED}"
    if are_uneven(m.quality):
        return f"{NO_FINGER}: {UNEVEN}"
    return ""


def are_uneven(quality: NDArray[np.uint8]) -> bool:
    """Return whether a few minutiae have nearly all of the quality, 0 to 100 each.

    How even qualities are is 1 where all are equal, near 0 where a few have nearly all: the mean of
    their squares, none of which counts more than the mean, by the mean. Of 1,218 real prints it is
    at least 0.71, of minutiae of other extractors 0.42, where these are fewer than 16 0.88.

    Examples
    --------
    >>> are_uneven(np.array([90, 5, 5], np.uint8)), are_uneven(np.array([90, 70, 80], np.uint8))
    (True, False)
    """
    value, number = quality.astype(np.float64), len(quality)
    total = value @ value
    even = np.minimum(number * (value * value), total).sum()  # by `number`
    least = LEAST_EVEN if number >= FEW_MINUTIAE else LEAST_EVEN_OF_FEW
    return bool(even < least * number * total)


def lie_off_ridges(on: NDArray[np.bool_], apart: NDArray[np.floating]) -> bool:
    """Return whether few minutiae of a print lie on its ridges, or most of them across.

    `apart` has the angle between the direction and the ridges, in radians, where `on` is true.
    """
    return bool(on.mean() < LEAST_INSIDE or np.cos(2.0 * apart).mean() < LEAST_ALONG)


def _coherence(xy: NDArray[np.floating], angle: NDArray[np.floating]) -> float:
    """Return how parallel neighbouring minutiae are, -1 to 1."""
    apart = _distances(xy)
    nearest = np.argsort(apart, axis=1, kind="stable")[:, :NEIGHBOURS]
    weight = np.exp(-np.take_along_axis(apart, nearest, axis=1) / FADING_PX)
    agreement = np.cos(2.0 * (angle[:, None] - angle[nearest]))
    return float((weight * agreement).sum() / max(float(weight.sum()), 1e-9))


def _distances(xy: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the distances between points, infinite from a point to itself."""
    apart: NDArray[np.floating] = np.hypot(*(xy[:, None] - xy).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    return apart
