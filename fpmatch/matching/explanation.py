"""What explains a decision: the one place that computes what the decision itself does not need."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from fpmatch.matching.calibration import score_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.pipeline.ridge_map import RidgeMap
    from fpmatch.matching.result import Comparison, Explaining, Matcher, Shortage
    from fpmatch.templates.minutiae import Template

    Side = tuple[Template, Any]  # a template, and what the matcher prepared of it


def as_explaining(matcher: Matcher) -> Explaining | None:
    """Return a matcher that can explain its comparisons; None for another."""
    # isinstance takes as long as a comparison of a protocol
    return cast("Explaining", matcher) if hasattr(matcher, "explain") else None


@dataclass(frozen=True, eq=False)
class Explanation:
    """Explain the decision `match` on a comparison; each part is computed once, when asked for.

    `impressions` are given of a finger; `reference` is one of them. `rho` is the share that
    decided, None where the score did.
    """

    matcher: Matcher
    calibration: Calibration | None
    probe: Side
    reference: Side
    comparison: Comparison
    match: bool
    threshold: float
    rho: float | None = None
    impressions: Sequence[Side] = ()

    @cached_property
    def evidence(self) -> Comparison:
        """The comparison in full: for a non-match, under the best transform there is."""
        evidence, matcher = self.comparison, as_explaining(self.matcher)
        if matcher is not None:
            if not self.match:
                evidence = matcher.explain(self.probe[1], self.reference[1], evidence)
            if not self.impressions:
                compared = matcher.compared(self.probe[1], self.reference[1], evidence)
                evidence = replace(evidence, compared=compared)
        if not self.match and not evidence.reason:
            by_score = self.rho is None
            reason = "the score is below the threshold" if by_score else "too few minutiae agree"
            evidence = replace(evidence, reason=reason)
        return evidence

    @cached_property
    def shortage(self) -> Shortage | None:
        """What the prints lack for a decision, at the resolutions they state."""
        from fpmatch.matching.decision import find_shortage  # noqa: PLC0415

        references = self.impressions or [self.reference]
        return find_shortage(self.matcher, self.calibration, self.probe, references, self.threshold)

    @cached_property
    def reachable_score(self) -> float | None:
        """Score that half of the genuine comparisons of as much skin reach; None if unknown."""
        from fpmatch.matching.decision import (  # noqa: PLC0415
            evidence_in,
            reachable_scores,
            reachable_similarities,
        )

        ours = evidence_in(self.matcher, *self.probe)
        references = self.impressions or [self.reference]
        theirs = np.stack([evidence_in(self.matcher, *one) for one in references])
        similarities = reachable_similarities(self.matcher, ours, theirs)
        reachable = reachable_scores(self.calibration, similarities).max()
        return float(reachable) if math.isfinite(reachable) else None

    @cached_property
    def ridge_map(self) -> RidgeMap | None:
        """Where the ridges agree; None where they were not compared."""
        ridges: RidgeMap | None = None
        if hasattr(self.matcher, "ridge_map"):
            ridges = self.matcher.ridge_map(self.probe[1], self.reference[1], self.evidence)
        return ridges

    @cached_property
    def mesh_points(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """The pairs where the matcher's mesh has them; None where it has none."""
        points: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        if hasattr(self.matcher, "mesh_points"):
            points = self.matcher.mesh_points(self.probe[1], self.reference[1], self.evidence)
        return points

    def possible_scales(self, ratios: Sequence[float]) -> Sequence[float]:
        """Return those of `ratios` by which the probe's lengths may be wrong."""
        matcher = as_explaining(self.matcher)
        return (
            ratios
            if matcher is None
            else matcher.possible_scales(self.probe[1], self.reference[1], ratios)
        )

    def score_at_scale(self, probe: Template) -> float:
        """Return the score of the probe at another resolution against the reference."""
        # the reference, which is prepared for many comparisons, goes first: the score is the same
        comparison = self.matcher.compare(self.reference[1], self.matcher.prepare(probe))
        return score_of(self.calibration, comparison.similarity)

    def pairs_at_scale(self, probe: Template) -> NDArray[np.int32]:
        """Return the pairs of the probe at another resolution and the reference."""
        return self.matcher.compare(self.matcher.prepare(probe), self.reference[1]).pairs
