"""The three outcomes of a comparison, and what two prints lack where it is inconclusive.

A score below the threshold is evidence of different fingers only where genuine comparisons of
prints with as many minutiae, on as large an area, reach the threshold. The score that half of them
reach is the reachable score of two prints. It was measured on synthetic prints and parts of them,
by ``python -m research train score``. Where it is below the threshold, the comparison is
inconclusive; so it is where a print shows no ridges of a finger, or minutiae that do not lie along
them, and where a resolution that no file states decides.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.matching.result import INCONCLUSIVE, MATCH, NO_MATCH, Shortage, call_matcher
from fpmatch.printable import count
from fpmatch.templates.minutiae import MM_PER_INCH
from fpmatch.templates.plausibility import OFF_RIDGES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.templates.minutiae import Template
    from fpmatch.templates.ridge_field import RidgeField

NO_RIDGES: Final = "no ridges"
NO_FINGER: Final = "no finger"
TOO_LITTLE_SKIN: Final = "too little skin"
TOO_FEW_MINUTIAE: Final = "too few minutiae"
THRESHOLD_TOO_HIGH: Final = "threshold too high"

MIN_SOLIDITY: Final = 0.55  # share of the ridges' convex hull; .67 is the least of 1,218 prints
MAX_UNIFORMITY: Final = 0.97  # of ridges on more than ENOUGH_MM2; .94 is the most of those prints
LEAST_MINUTIAE: Final = 3  # without an estimate: fewer make no triangle
ENOUGH_MM2: Final = 77.0  # more skin adds nothing to the reachable score
FACTORS: Final = tuple(1.1**k for k in range(1, 49))  # of more skin, up to about a hundred times
_CORNERS: Final = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.int32)  # of a cell
NO_EVIDENCE: Final = (0.0,) * 5  # amount of evidence in a print that shows no finger


def decide(match: ArrayLike, reachable: ArrayLike, threshold: float) -> NDArray[np.str_]:
    """Return the outcome of each comparison, by whether it is a match and its reachable score.

    Examples
    --------
    >>> decide([True, True, False, False], [60, 20, 60, 20], 40).tolist()
    ['match', 'match', 'no match', 'inconclusive']
    """
    lacking = np.asarray(reachable, np.float64) < threshold
    return np.where(match, MATCH, np.where(lacking, INCONCLUSIVE, NO_MATCH))


def evidence_in(matcher: Any, template: Template, prepared: object) -> NDArray[np.float64]:
    """Return the amount of evidence in a print, shape (5,), as the matcher measures it.

    It is `NO_EVIDENCE` where the print does not show a finger; see `lacks_ridges`.
    """
    if lacks_ridges(template):
        return np.array(NO_EVIDENCE)
    if hasattr(matcher, "amount"):
        amount: NDArray[np.float64] = call_matcher(matcher, "amount", prepared)
        return amount
    return np.array([len(template.minutiae), *NO_EVIDENCE[1:]])


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
    if solidity(field.mask) < MIN_SOLIDITY:
        return "has no ridges of a finger: they are scattered"
    straight = ridge_area_mm2(template) > ENOUGH_MM2 and uniformity(field) > MAX_UNIFORMITY
    return "has no ridges of a finger: they are straight" if straight else ""


def solidity(mask: NDArray[np.bool_]) -> float:
    """Return the share of their convex hull that the cells of a mask, at least one, fill."""
    cells = mask.view(np.uint8)
    corners = cv2.convexHull(cv2.findNonZero(cells)) + _CORNERS
    hull = cv2.contourArea(cv2.convexHull(corners.reshape(-1, 2)))
    return float(cv2.countNonZero(cells) / hull)


def uniformity(field: RidgeField) -> float:
    """Return how far the ridges run one way: 1 if all are parallel, about 0 if none prevails."""
    twice = 2.0 * field.orientation[field.mask]
    return math.hypot(np.cos(twice).mean(), np.sin(twice).mean())


def ridge_area_mm2(template: Template) -> float:
    """Return the area of the ridges of a template, in mm²; 0 without a ridge field."""
    field = template.field
    if field is None:
        return 0.0
    return float(np.count_nonzero(field.mask) * (field.step * MM_PER_INCH / template.dpi) ** 2)


def reachable_similarities(
    matcher: Any, probe: NDArray[np.float64], references: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the similarities that half of the genuine comparisons of as much evidence reach.

    `probe` and `references` are amounts of evidence, shape (..., 5). The similarities are infinite
    where the matcher gives no estimate, and minus infinity where a print does not show a finger.
    """
    fewest = np.minimum(probe[..., 0], references[..., 0])
    if not hasattr(matcher, "typical_similarities"):
        return np.where(fewest >= LEAST_MINUTIAE, math.inf, -math.inf)
    typical = call_matcher(matcher, "typical_similarities", probe, references)
    return np.where(fewest > 0, typical, -math.inf)


def reachable_scores(
    calibration: Calibration | None, similarities: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the reachable scores from what `reachable_similarities` returned.

    Infinite ones stay so; without a calibration, all others become infinite.
    """
    known = np.isfinite(similarities)
    if calibration is None:
        return np.where(known, math.inf, similarities)
    return np.where(known, calibration.scores(np.where(known, similarities, 0.0)), similarities)


def find_shortage(
    matcher: Any,
    calibration: Calibration | None,
    probe: tuple[Template, object],
    references: Sequence[tuple[Template, object]],
    threshold: float,
) -> Shortage | None:
    """Return what a probe and the best of the references lack for a decision; None where nothing.

    Each print is given as a template, and as the matcher prepared it.
    """
    ours = evidence_in(matcher, *probe)
    theirs = np.stack([evidence_in(matcher, *one) for one in references])
    reachable = reachable_scores(calibration, reachable_similarities(matcher, ours, theirs))
    best = int(np.argmax(reachable))
    needed = 0.0 if math.isnan(threshold) else threshold  # of a matcher without a calibration
    if reachable[best] >= needed:
        return None
    sides = {"probe": probe[0], "reference": references[best][0]}
    why = {name: lacks_ridges(side) for name, side in sides.items()}
    code = NO_RIDGES if any(why.values()) else NO_FINGER
    for (name, side), minutiae in zip(sides.items(), (ours[0], theirs[best, 0]), strict=True):
        if len(side.minutiae) and not minutiae:  # the matcher counts none
            why[name] = why[name] or f"shows no finger: {OFF_RIDGES}"
    if any(why.values()):
        message = "; ".join(f"the {name} {text}" for name, text in why.items() if text)
        return Shortage(code, message)
    if math.isinf(reachable[best]) and not hasattr(matcher, "available"):
        fewest = count(int(min(ours[0], theirs[best, 0])), "minutia", "minutiae")
        message = f"{fewest} in the smaller print, where {LEAST_MINUTIAE} are needed at least"
        return Shortage(TOO_FEW_MINUTIAE, message)
    return _needed(matcher, calibration, probe[1], references[best][1], threshold)


def _needed(
    matcher: Any,
    calibration: Calibration | None,
    probe: object,
    reference: object,
    threshold: float,
) -> Shortage:
    """Return how much evidence there is, and how much it takes."""

    def reaches(factor: float) -> bool:
        sides = (call_matcher(matcher, "amount", side, factor) for side in (probe, reference))
        reachable = reachable_scores(calibration, reachable_similarities(matcher, *sides))
        return bool(reachable >= threshold)

    minutiae, area = call_matcher(matcher, "available", probe, reference)
    enough = next(filter(reaches, FACTORS), None)
    if enough is None and minutiae >= LEAST_MINUTIAE:
        message = f"no amount of skin would usually reach a score of {threshold:.1f}"
        return Shortage(THRESHOLD_TOO_HIGH, message)
    message = f"{count(minutiae, 'minutia', 'minutiae')} on {area:.0f} mm² in the smaller print"
    if enough is not None:
        message += (
            f", where about {math.ceil(enough * minutiae)} on {enough * area:.0f} mm² are usually "
            f"needed for a score of {threshold:.1f}"
        )
    return Shortage(TOO_LITTLE_SKIN if area < ENOUGH_MM2 else TOO_FEW_MINUTIAE, message)
