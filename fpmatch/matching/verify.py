"""Verification: two templates become a decision, which is explained where that is asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError, number_text
from fpmatch.matching.calibration import (
    MAX_SCORE,
    is_calibrated,
    load_calibration,
    score_of,
    score_to_fmr,
)
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher
from fpmatch.matching.result import check_repeats, compare_prepared, may_match, prepare_print
from fpmatch.matching.verification import Explanation, Verification
from fpmatch.templates.bounds import have_same_minutiae

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.result import Comparison, Identity, Matcher
    from fpmatch.templates.minutiae import Template

    Side = tuple[Template, Any]  # a template, and what the matcher prepared of it

DEFAULT_THRESHOLD: Final = 40.0  # one false match in 10,000 comparisons


@dataclass(frozen=True, slots=True)
class Rule:
    """How comparisons by a matcher become decisions: by their score, or by the share `rho`.

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
        """Return the rule of `verify`, whose parameters and errors these are."""
        if threshold is not None and not 0 <= threshold <= MAX_SCORE:
            raise MatcherError(f"threshold must lie in 0..100, not {number_text(threshold)}")
        chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
        rho: float | None = getattr(chosen, "rho", None) if threshold is None else None
        if calibration is None and (rho is None or is_calibrated(chosen.name)):
            calibration = load_calibration(chosen.name)
        needed = DEFAULT_THRESHOLD if threshold is None else float(threshold)
        return cls(chosen, calibration, needed if rho is None else score_of(calibration, rho), rho)

    def decide(
        self,
        probe: Side,
        reference: Side,
        comparison: Comparison,
        score: float,
        impressions: Sequence[Side] = (),
        images: Sequence[NDArray[np.uint8] | None] = (None, None),
    ) -> Verification:
        """Return the decision on two prints, or on a probe and a finger, that have this score.

        Of a finger all `impressions` are given; `reference` is the most similar of them. `images`
        are the pixels of probe and reference.
        """
        curve, rho = self.calibration, self.rho
        enough = score >= self.threshold if rho is None else comparison.similarity > rho
        match = enough and may_match(self.matcher, comparison)
        explanation = Explanation(
            matcher=self.matcher,
            calibration=curve,
            probe=probe,
            reference=reference,
            comparison=comparison,
            match=match,
            threshold=self.threshold,
            rho=rho,
            impressions=impressions,
        )
        return Verification(
            match=match,
            score=score,
            fmr=math.nan if curve is None else score_to_fmr(score),
            threshold=self.threshold,
            matcher=self.matcher.name,
            comparison=comparison,
            probe=probe[0],
            reference=reference[0],
            smallest_measured_fmr=0.0
            if curve is None
            else score_to_fmr(curve.largest_measured_score),
            rho=rho,
            explanation=explanation,
            identical=find_identity((probe[0], reference[0]), images),
        )


def verify(
    probe: Template,
    reference: Template,
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    threshold: float | None = None,
    calibration: Calibration | None = None,
    images: Sequence[NDArray[np.uint8] | None] = (None, None),
    allowance: float = 0.0,
) -> Verification:
    """Decide whether two templates come from the same finger; see `fpmatch.verify`.

    The one function that does so: `fpmatch.verify`, the commands and the web interface call it.
    A matcher that wants them is given the `images`. A score that decides is lowered by `allowance`,
    for one of several tries.
    """
    rule = Rule.of(matcher, threshold, calibration)
    chosen, curve = rule.matcher, rule.calibration
    sides = zip((probe, reference), images, strict=True)
    ours, theirs = (prepare_print(chosen, *side) for side in sides)
    comparison = compare_prepared(chosen, ours, theirs)
    check_repeats(chosen, ours, theirs, comparison.similarity)
    score = score_of(curve, comparison.similarity)
    if allowance and rule.rho is None:
        score = max(0.0, score - allowance)
    return rule.decide((probe, ours), (reference, theirs), comparison, score, images=images)


def find_identity(
    templates: Sequence[Template], images: Sequence[NDArray[np.uint8] | None] = (None, None)
) -> Identity | None:
    """Return what of two prints is the same: "pixels" of their images, or "template".

    Templates are the same where frame and minutiae are, as a gallery stores them. None where
    neither is the same, or templates have so few minutiae that others may be equal.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template
    >>> one = Template(Minutiae(x=[1, 9, 4, 7], y=[2, 8, 3, 5], angle=[0, 1, 2, 3]), 300, 300)
    >>> find_identity((one, one)), find_identity((one, Template(one.minutiae, 400, 300)))
    ('template', None)
    """
    probe, reference = images
    if probe is not None and reference is not None and np.array_equal(probe, reference):
        return "pixels"
    return "template" if have_same_minutiae(*templates) else None
