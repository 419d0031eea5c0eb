"""Verification: two templates become a decision."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import (
    MAX_SCORE,
    calibrated_matchers,
    load_calibration,
    score_to_fmr,
)
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.result import Verification, as_explaining

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison, Matcher
    from fpmatch.matching.ridge_map import RidgeMap
    from fpmatch.minutiae import Template

FACTORS: Final = tuple(1.1**k for k in range(1, 49))  # of more skin, up to about a hundred times
DEFAULT_THRESHOLD: Final = 40.0  # one false match in 10,000 comparisons


def verify(
    probe: Template,
    reference: Template,
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    threshold: float | None = None,
    calibration: Calibration | None = None,
) -> Verification:
    """Decide whether two templates come from the same finger.

    Parameters
    ----------
    probe, reference : Template
        The two impressions.
    matcher : str or Matcher
        Name of the matcher, one of `matcher_names`, or a matcher with parameters of its own, as
        ``PaperMatcher(rho=0.9)``.
    threshold : float, optional
        Score from which on the answer is yes: 40 for a false match rate of 0.01 %,
        ``-10·log10(FMR)`` in general (see `fmr_to_score`). Default: the matcher's own rule where it
        has one (the matcher "paper": more than a share ρ of the minutiae paired), else 40.
    calibration : Calibration, optional
        Turns similarities into scores (default: as measured by the package).

    Returns
    -------
    Verification
        Decision, score, transform and pairs; where the answer is no, the reason.

    Raises
    ------
    MatcherError
        If the matcher is unknown, or not calibrated and without a rule of its own, or the threshold
        is not in 0..100.

    References
    ----------
    Choi, Lee, Lee, "Point pattern matching algorithm using unit-circle parametrization", Fig. 7.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> empty = Template(Minutiae.empty(), width=300, height=300)
    >>> result = verify(empty, empty)
    >>> result.match, result.score
    (False, 0.0)
    """
    if threshold is not None and not 0 <= threshold <= MAX_SCORE:
        raise MatcherError(f"threshold must lie in 0..100, not {threshold:g}")
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    rho: float | None = getattr(chosen, "rho", None) if threshold is None else None
    if calibration is None and (rho is None or chosen.name in calibrated_matchers()):
        calibration = load_calibration(chosen.name)
    pair = PreparedPair(chosen, chosen.prepare(probe), chosen.prepare(reference), calibration)
    comparison = chosen.compare(pair.probe, pair.reference)
    score = _score(calibration, comparison.similarity)
    if rho is None:
        needed = DEFAULT_THRESHOLD if threshold is None else float(threshold)
        enough = score >= needed
    else:
        needed = _score(calibration, rho)
        enough = comparison.similarity > rho
    return Verification(
        match=comparison.transform is not None and enough,
        score=score,
        fmr=math.nan if calibration is None else score_to_fmr(score),
        threshold=needed,
        matcher=chosen.name,
        comparison=comparison,
        probe=probe,
        reference=reference,
        smallest_measured_fmr=0.0
        if calibration is None
        else score_to_fmr(calibration.largest_measured_score),
        rho=rho,
        rematch=pair,
    )


@dataclass(frozen=True, slots=True, eq=False)
class PreparedPair:
    """Hold two prints as the matcher prepared them, to compute what a decision does not need."""

    matcher: Matcher
    probe: Any
    reference: Any
    calibration: Calibration | None
    amount: bool = True  # whether to state how much was compared, and how much is usually needed

    def explain(self, verification: Verification) -> Comparison:
        """Return the evidence of a verification of the two prints in full."""
        found, matcher = verification.comparison, as_explaining(self.matcher)
        if matcher is not None:
            if not verification.match:
                found = matcher.explain(self.probe, self.reference, found)
            if self.amount:
                compared = matcher.compared(self.probe, self.reference, found)
                found = replace(found, compared=compared)
        if verification.match:
            return found
        shortage = self._shortage(verification.threshold) if verification.rho is None else ""
        reason = found.reason or "too few minutiae agree"
        return replace(found, reason="; ".join(filter(None, [shortage, reason])))

    def ridge_map(self, evidence: Comparison) -> RidgeMap | None:
        """Return where the ridges agree in the evidence; None where they were not compared."""
        found: RidgeMap | None = None
        if hasattr(self.matcher, "ridge_map"):
            found = self.matcher.ridge_map(self.probe, self.reference, evidence)
        return found

    def possible_scales(self, ratios: Sequence[float]) -> Sequence[float]:
        """Return those of `ratios` by which the probe's lengths may be wrong."""
        matcher = as_explaining(self.matcher)
        if matcher is None:
            return ratios
        return matcher.possible_scales(self.probe, self.reference, ratios)

    def score(self, probe: Template) -> float:
        """Return the score of another probe against the reference."""
        # the reference, which is prepared for many comparisons, goes first: the score is the same
        found = self.matcher.compare(self.reference, self.matcher.prepare(probe))
        return _score(self.calibration, found.similarity)

    def pairs(self, probe: Template) -> NDArray[np.int32]:
        """Return the pairs of another probe and the reference."""
        return self.matcher.compare(self.matcher.prepare(probe), self.reference).pairs

    def _shortage(self, needed: float) -> str:
        """Return a note where there is too little to decide: how much it would take; else "".

        It is too little where fewer than half of the genuine comparisons would match.
        """
        matcher, calibration = as_explaining(self.matcher), self.calibration
        if not self.amount or matcher is None or calibration is None:
            return ""

        def reaches(factor: float) -> bool:
            typical = matcher.typical_similarity(self.probe, self.reference, factor)
            return calibration.score(typical) >= needed

        if reaches(1.0):
            return ""
        minutiae, area = matcher.available(self.probe, self.reference)
        given = f"too little to decide: {minutiae} minutiae on {area:.0f} mm2 in the smaller print"
        enough = next(filter(reaches, FACTORS), None)
        if enough is None:
            return f"{given}; no amount is usually enough for a score of {needed:.1f}"
        return (
            f"{given}, where about {math.ceil(enough * minutiae)} on {enough * area:.0f} mm2 are "
            f"usually needed for a score of {needed:.1f}"
        )


def _score(calibration: Calibration | None, similarity: float) -> float:
    return math.nan if calibration is None else calibration.score(similarity)
