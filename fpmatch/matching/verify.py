"""Verification: two templates become a decision."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import calibrated_matchers, load_calibration, score_to_fmr
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.result import DecidesByShare, Explaining, StatesAmount, Verification

if TYPE_CHECKING:
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Matcher
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
        What the matcher's similarities are worth (default: as measured by the package).

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
    if threshold is not None and not 0 <= threshold <= 100:
        raise MatcherError(f"threshold must lie in 0..100, not {threshold:g}")
    chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    rho = chosen.rho if threshold is None and isinstance(chosen, DecidesByShare) else None
    if calibration is None and (rho is None or chosen.name in calibrated_matchers()):
        calibration = load_calibration(chosen.name)
    prepared = chosen.prepare(probe), chosen.prepare(reference)
    comparison = chosen.compare(*prepared)
    score = _score(calibration, comparison.similarity)
    if rho is not None:
        enough, needed = comparison.similarity > rho, _score(calibration, rho)
    else:
        needed = DEFAULT_THRESHOLD if threshold is None else float(threshold)
        enough = score >= needed
    match = comparison.transform is not None and enough
    if not match and isinstance(chosen, Explaining):
        comparison = chosen.explain(*prepared)
    reason = "" if match else comparison.reason or "too few minutiae agree"
    if not match and rho is None and isinstance(chosen, StatesAmount) and calibration is not None:
        reason = "; ".join(filter(None, [_shortage(chosen, prepared, calibration, needed), reason]))
    return Verification(
        match=match,
        score=score,
        fmr=math.nan if calibration is None else score_to_fmr(score),
        threshold=needed,
        matcher=chosen.name,
        transform=comparison.transform,
        pairs=comparison.pairs,
        rms_px=comparison.rms_px,
        agreement=comparison.agreement,
        overlap=comparison.overlap,
        reason=reason,
        probe=probe,
        reference=reference,
        fmr_reach=0.0 if calibration is None else score_to_fmr(calibration.reach),
        rho=rho,
        compared=chosen.compared(*prepared) if isinstance(chosen, StatesAmount) else None,
    )


def _shortage(
    matcher: StatesAmount, prepared: tuple[Any, Any], calibration: Calibration, needed: float
) -> str:
    """Say that there is too little to decide, and how much it would take; "" where there is enough.

    It is too little where fewer than half of the comparisons of one finger would match.
    """

    def typical(factor: float) -> float:
        return calibration.score(matcher.typical_similarity(*prepared, factor))

    minutiae, area = matcher.available(*prepared)
    if typical(1.0) >= needed:
        return ""
    there = f"too little to decide: {minutiae} minutiae on {area:.0f} mm2 in the smaller print"
    enough = next((factor for factor in FACTORS if typical(factor) >= needed), None)
    if enough is None:
        return f"{there}; no amount is usually enough for a score of {needed:.1f}"
    return (
        f"{there}, where about {math.ceil(enough * minutiae)} on {enough * area:.0f} mm2 are "
        f"usually needed for a score of {needed:.1f}"
    )


def _score(calibration: Calibration | None, similarity: float) -> float:
    return math.nan if calibration is None else calibration.score(similarity)
