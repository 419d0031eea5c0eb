"""How comparisons by a matcher become decisions: by their score, or by the share `rho`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from fpmatch.errors import MatcherError, number_text
from fpmatch.matching.calibration import MAX_SCORE, is_calibrated, load_calibration, score_of
from fpmatch.matching.registry import get_matcher
from fpmatch.matching.result import Matcher

if TYPE_CHECKING:
    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison

DEFAULT_THRESHOLD: Final = 40.0  # one false match in 10,000 comparisons


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
        return cls(chosen, calibration, needed if rho is None else score_of(calibration, rho), rho)

    def is_match(self, comparison: Comparison, score: float) -> bool:
        """Return whether a comparison of this score is a match; one that aligns nothing is none."""
        enough = score >= self.threshold if self.rho is None else comparison.similarity > self.rho
        return bool(enough) and comparison.transform is not None
