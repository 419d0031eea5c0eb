"""What is a match, and what two prints lack where a comparison is inconclusive.

A comparison is a match by its score, or by the share `rho` of paired minutiae. A score below the
threshold is evidence of different fingers only where genuine comparisons of prints with as many
minutiae, on as large an area, reach the threshold. The score that half of them reach is the
reachable score of two prints, measured on synthetic prints by ``python -m research train score``.
Where it is below the threshold, the comparison is inconclusive; so it is where a print shows no
ridges of a finger, or minutiae that do not lie along them, and where a resolution that no file
states decides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from fpmatch.base.plugins import call_matcher
from fpmatch.errors import MatcherError, number_text
from fpmatch.matching.calibration import MAX_SCORE, is_calibrated, load_calibration
from fpmatch.matching.registry import get_matcher
from fpmatch.matching.result import Matcher, Shortage
from fpmatch.printable import count
from fpmatch.templates.minutiae import MM_PER_INCH, STANDARD_DPI
from fpmatch.templates.plausibility import ENOUGH_MM2, OFF_RIDGES, lacks_ridges

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison, Side
    from fpmatch.templates.minutiae import Template

DEFAULT_THRESHOLD: Final = 40.0  # one false match in 10,000 comparisons
LEAST_MINUTIAE: Final = 3  # without an estimate: fewer make no triangle
FACTORS: Final = tuple(1.1**k for k in range(1, 49))  # of more skin, up to about a hundred times


@dataclass(frozen=True, slots=True)
class Rule:
    """A matcher, its calibration, and what is a match.

    `threshold` is the least score of a match; where `rho` decides, the score of that share.
    """

    matcher: Matcher
    calibration: Calibration | None
    threshold: float
    rho: float | None

    @classmethod
    def of(
        cls, matcher: str | Matcher, threshold: float | None, calibration: Calibration | None
    ) -> Rule:
        """Return the rule of `fpmatch.verify`, whose parameters and errors these are."""
        if threshold is not None and not 0 <= threshold <= MAX_SCORE:
            raise MatcherError(f"threshold must lie in 0..100, not {number_text(threshold)}")
        chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
        if not isinstance(chosen, Matcher):
            raise MatcherError(
                f"matcher {type(chosen).__name__} is no subclass of fpmatch.matching.result.Matcher"
            )
        rho = chosen.rho if threshold is None else None
        if calibration is None and (rho is None or is_calibrated(chosen.name)):
            calibration = load_calibration(chosen.name)
        needed = DEFAULT_THRESHOLD if threshold is None else float(threshold)
        rule = cls(chosen, calibration, needed, rho)
        return rule if rho is None else replace(rule, threshold=rule.score(rho))

    def score(self, similarity: float) -> float:
        """Return the calibrated score of a similarity; NaN without a calibration."""
        if self.calibration is None:
            return math.nan
        return float(self.calibration.scores(similarity))

    def is_match(self, comparison: Comparison, score: float) -> bool:
        """Return whether a comparison of this score is a match; one that aligns nothing is none."""
        enough = score >= self.threshold if self.rho is None else comparison.similarity > self.rho
        return bool(enough) and comparison.transform is not None


def evidence_in(matcher: Matcher, template: Template, prepared: object) -> NDArray[np.float64]:
    """Return the amount of evidence in a print, shape (5,), as the matcher measures it.

    It is 0 where the print does not show a finger; see `lacks_ridges`.
    """
    if lacks_ridges(template):
        return np.zeros(5)
    amount: NDArray[np.float64] | None = call_matcher(matcher, "amount", prepared)
    return np.array([len(template.minutiae), 0.0, 0.0, 0.0, 0.0]) if amount is None else amount


def reachable_scores(
    matcher: Matcher,
    calibration: Calibration | None,
    probe: NDArray[np.float64],
    references: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the scores that half of the genuine comparisons of as much evidence reach.

    `probe` and `references` are amounts of evidence, shape (..., 5). The scores are infinite where
    the matcher gives no estimate or has no calibration, and minus infinity where a print does not
    show a finger, or one of which nothing is estimated has fewer than `LEAST_MINUTIAE`.
    """
    fewest = np.minimum(probe[..., 0], references[..., 0])
    typical = call_matcher(matcher, "typical_similarities", probe, references)
    unknown = np.isinf(typical)
    scores = typical if calibration is None else calibration.scores(typical)
    scores = np.where(unknown | (calibration is None), math.inf, scores)
    return np.where(fewest >= np.where(unknown, LEAST_MINUTIAE, 1), scores, -math.inf)


class Reachable(NamedTuple):
    """What a probe and the best of its references have to reach a score by."""

    score: float  # infinite where nothing is estimated
    sides: tuple[Side, Side]  # the probe, and that reference
    amounts: NDArray[np.float64]  # of evidence of both, shape (2, 5)


def find_reachable(
    matcher: Matcher, calibration: Calibration | None, probe: Side, references: Sequence[Side]
) -> Reachable:
    """Return the reachable score of a probe and the best of the references.

    Each print is given as a template, and as the matcher prepared it.
    """
    ours = evidence_in(matcher, *probe)
    theirs = np.stack([evidence_in(matcher, *one) for one in references])
    reachable = reachable_scores(matcher, calibration, ours, theirs)
    best = int(np.argmax(reachable))
    sides = probe, references[best]
    return Reachable(float(reachable[best]), sides, np.stack([ours, theirs[best]]))


def find_shortage(
    matcher: Matcher, calibration: Calibration | None, known: Reachable, threshold: float
) -> Shortage | None:
    """Return what prints of a `known` reachable score lack for a decision; None where nothing.

    `threshold` is the least score of a match, NaN without a calibration.
    """
    if known.score >= (0.0 if math.isnan(threshold) else threshold):
        return None
    sides = dict(zip(("probe", "reference"), known.sides, strict=True))
    why = {name: lacks_ridges(template) for name, (template, _) in sides.items()}
    code = "no ridges" if any(why.values()) else "no finger"
    for (name, (template, _)), amount in zip(sides.items(), known.amounts, strict=True):
        if len(template.minutiae) and not amount[0]:  # the matcher counts none
            why[name] = why[name] or f"shows no finger: {OFF_RIDGES}"
    if any(why.values()):
        message = "; ".join(f"the {name} {text}" for name, text in why.items() if text)
        return Shortage(code, message)
    minutiae, area_px2 = known.amounts[:, :2].min(axis=0).tolist()
    fewest = count(int(minutiae), "minutia", "minutiae")
    if math.isinf(known.score) and not area_px2:
        message = f"{fewest} in the smaller print, where {LEAST_MINUTIAE} are needed at least"
        return Shortage("too few minutiae", message)

    def reaches(factor: float) -> bool:
        amounts = (call_matcher(matcher, "amount", side, factor) for _, side in sides.values())
        return bool(reachable_scores(matcher, calibration, *amounts) >= threshold)

    area = area_px2 * (MM_PER_INCH / STANDARD_DPI) ** 2
    enough = next(filter(reaches, FACTORS), None)
    if enough is None and minutiae >= LEAST_MINUTIAE:
        message = f"no amount of skin would usually reach a score of {threshold:.1f}"
        return Shortage("threshold too high", message)
    message = f"{fewest} on {area:.0f} mm² in the smaller print"
    if enough is not None:
        message += (
            f", where about {math.ceil(enough * minutiae)} on {enough * area:.0f} mm² are usually "
            f"needed for a score of {threshold:.1f}"
        )
    return Shortage("too little skin" if area < ENOUGH_MM2 else "too few minutiae", message)
