"""Verification: two templates become a decision."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import load_calibration, score_to_fmr
from fpmatch.matching.matchers import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.result import Explaining, Verification

if TYPE_CHECKING:
    from fpmatch.matching.calibration import Calibration
    from fpmatch.minutiae import Template

DEFAULT_THRESHOLD: Final = 40.0  # one false match in 10,000 comparisons


def verify(
    probe: Template,
    reference: Template,
    *,
    matcher: str = DEFAULT_MATCHER,
    threshold: float = DEFAULT_THRESHOLD,
    calibration: Calibration | None = None,
) -> Verification:
    """Decide whether two templates come from the same finger.

    Parameters
    ----------
    probe, reference : Template
        The two impressions.
    matcher : str
        Name of the matcher, one of `matcher_names`.
    threshold : float
        Score from which on the answer is yes: 40 (default) for a false match rate of 0.01 %,
        ``-10·log10(FMR)`` in general (see `fmr_to_score`).
    calibration : Calibration, optional
        What the matcher's similarities are worth (default: as measured by the package).

    Returns
    -------
    Verification
        Decision, score, transform and pairs; where the answer is no, the reason.

    Raises
    ------
    MatcherError
        If the matcher is unknown or not calibrated, or the threshold is not in 0..100.

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
    if not 0 <= threshold <= 100:
        raise MatcherError(f"threshold must lie in 0..100, not {threshold:g}")
    chosen = get_matcher(matcher)
    prepared = chosen.prepare(probe), chosen.prepare(reference)
    comparison = chosen.compare(*prepared)
    calibration = load_calibration(matcher) if calibration is None else calibration
    score = calibration.score(comparison.similarity)
    match = comparison.transform is not None and score >= threshold
    if not match and isinstance(chosen, Explaining):
        comparison = chosen.explain(*prepared)
    reason = "" if match else comparison.reason or "too few minutiae agree"
    return Verification(
        match=match,
        score=score,
        fmr=score_to_fmr(score),
        threshold=float(threshold),
        matcher=matcher,
        transform=comparison.transform,
        pairs=comparison.pairs,
        rms_px=comparison.rms_px,
        agreement=comparison.agreement,
        overlap=comparison.overlap,
        reason=reason,
        probe=probe,
        reference=reference,
        fmr_reach=score_to_fmr(calibration.reach),
    )
