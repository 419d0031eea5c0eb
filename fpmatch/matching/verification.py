"""Verification: the decision on two templates, and what explains it.

`Explanation` is the one place that computes what the decision itself does not need.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from fpmatch.matching.calibration import allowance, score_of
from fpmatch.matching.result import (
    INCONCLUSIVE,
    MATCH,
    NO_MATCH,
    UNKNOWN_RESOLUTION,
    Shortage,
    call_matcher,
    compare_prepared,
    may_match,
    prepare_print,
    wants_image,
)
from fpmatch.matching.scale import ScaleMeasurement, assessed, measure_scale
from fpmatch.templates.minutiae import MAX_DPI, MIN_DPI, Template

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.pipeline.ridge_map import RidgeMap
    from fpmatch.matching.result import (
        Compared,
        Comparison,
        Decision,
        Explaining,
        Identity,
        Matcher,
    )
    from fpmatch.pointset.geometry.similarity import Similarity

    Side = tuple[Template, Any]  # a template, and what the matcher prepared of it

SMALL_LOG_DIFFERENCE: Final = math.log1p(0.035)  # up to which a scale is not measured again
CANDIDATE_RATIOS: Final = (0.5, 0.63, 0.79, 0.89, 1.12, 1.26, 1.59, 2.0)  # where nothing matches
MIRRORED_SHARE: Final = 0.5  # of the false match rate, for the tries of a mirrored probe
MIRRORED: Final = (
    "mirrored, the probe matches, with a score of {:.1f}: is one of the images mirrored? "
    "(--mirror flips the probe)"
)
REFINEMENTS: Final = 2  # times that a scale is measured with the resolutions corrected


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
                evidence = self._ask("explain", evidence)
            if not self.impressions:
                compared = self._ask("compared", evidence)
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
            ridges = self._ask("ridge_map", self.evidence)
        return ridges

    @cached_property
    def mirrored_score(self) -> float | None:
        """Score of the mirrored probe, less what its tries cost; None unless it is a match."""
        if self.match or self.rho is not None or wants_image(self.matcher):
            return None
        mirrored = prepare_print(self.matcher, self.probe[0].mirrored(), None)
        references = self.impressions or [self.reference]
        tried = [compare_prepared(self.matcher, one, mirrored) for _, one in references]
        most = max((one.similarity for one in tried if may_match(self.matcher, one)), default=0.0)
        score = score_of(self.calibration, most) - allowance(MIRRORED_SHARE, len(tried))
        return score if score >= self.threshold else None

    def possible_scales(self, ratios: Sequence[float]) -> Sequence[float]:
        """Return those of `ratios` by which the probe's lengths may be wrong."""
        if wants_image(self.matcher):  # which is at one scale
            return ()
        if as_explaining(self.matcher) is None:
            return ratios
        possible: Sequence[float] = self._ask("possible_scales", ratios)
        return possible

    def score_at_scale(self, probe: Template) -> float:
        """Return the score of the probe at another resolution against the reference."""
        # the reference, which is prepared for many comparisons, goes first: the score is the same
        prepared = prepare_print(self.matcher, probe, None)
        comparison = compare_prepared(self.matcher, self.reference[1], prepared)
        return score_of(self.calibration, comparison.similarity)

    def pairs_at_scale(self, probe: Template) -> NDArray[np.int32]:
        """Return the pairs of the probe at another resolution and the reference."""
        prepared = prepare_print(self.matcher, probe, None)
        return compare_prepared(self.matcher, prepared, self.reference[1]).pairs

    def _ask(self, method: str, what: Any) -> Any:
        """Return what the matcher answers on the two prints."""
        return call_matcher(self.matcher, method, self.probe[1], self.reference[1], what)


@dataclass(frozen=True, eq=False)
class Verification:
    """The decision on two templates and the evidence for it; equal to itself alone.

    A decision alone costs one comparison. What else is asked for comes from `explanation`: the
    evidence (`transform`, `pairs`, `rms_px`, `agreement`, `overlap`, `reason`, `compared`) and what
    the prints lack for a decision are computed there, once.

    Parameters
    ----------
    match : bool
        The decision: whether `score` reaches `threshold`; where `rho` decides, whether
        `matched_share` is more than it.
    score : float
        ``-10 * log10(FMR)`` of the calibrated matcher, 0 to 100; NaN where `rho` decides and the
        matcher is not calibrated.
    fmr : float
        Estimated rate at which impostors reach this score; NaN with `score`.
    threshold : float
        The least score of a match; where `rho` decides, the score of a matched share of `rho`.
    matcher : str
        Name of the matcher.
    comparison : Comparison
        The matcher's result.
    probe, reference : Template
        The two templates compared.
    smallest_measured_fmr : float
        Smallest FMR that the calibration data measure; a lower `fmr` is extrapolated.
    rho : float or None
        Where the matcher decided by the share of minutiae that are paired: the share that is not
        enough for a match. None where the score decided.
    explanation : Explanation, optional
        What explains the decision; without it `comparison` is all there is.
    dpi_assumed : tuple of str
        The sides, "probe" and "reference", whose resolution neither a file nor the caller states.
    identical : str or None
        What of the two prints is the same: "pixels" of their images, or "template"; None where
        they differ. Else an impression is compared with itself, and `fmr` states no rate.
    """

    match: bool
    score: float
    fmr: float
    threshold: float
    matcher: str
    comparison: Comparison = field(repr=False)
    probe: Template = field(repr=False)
    reference: Template = field(repr=False)
    smallest_measured_fmr: float = 0.0
    rho: float | None = None
    explanation: Explanation | None = field(default=None, repr=False)
    dpi_assumed: tuple[str, ...] = ()
    identical: Identity | None = None

    @property
    def decision(self) -> Decision:
        """The outcome: "match", "no match" or "inconclusive"; the last where evidence lacks."""
        if self.match:
            return MATCH
        return NO_MATCH if self.shortage is None else INCONCLUSIVE

    @cached_property
    def shortage(self) -> Shortage | None:
        """What the prints lack for a decision; None for a match, and where they lack nothing."""
        if self.match:
            return None
        if self.dpi_assumed and self.scale is not None and self.scale.differs:
            sides = " and ".join(f"the {side}" for side in self.dpi_assumed)
            message = f"the resolution of {sides} is unknown, and at another one the prints match"
            return Shortage(UNKNOWN_RESOLUTION, message)
        return None if self.explanation is None else self.explanation.shortage

    @property
    def reachable_score(self) -> float | None:
        """Score that half of the genuine comparisons of as much skin reach; None if unknown."""
        return None if self.explanation is None else self.explanation.reachable_score

    @cached_property
    def scale(self) -> ScaleMeasurement | None:
        """Scale between the prints; see `fpmatch.find_scale`."""
        return find_scale(self)

    @property
    def evidence(self) -> Comparison:
        """The comparison in full: for a non-match, under the best transform there is."""
        return self.comparison if self.explanation is None else self.explanation.evidence

    @property
    def transform(self) -> Similarity | None:
        """The transform from the probe's pixels to the reference's; see `Comparison`."""
        return self.evidence.transform

    @property
    def pairs(self) -> NDArray[np.int32]:
        """Pairs of minutiae, shape (K, 2)."""
        return self.evidence.pairs

    @property
    def rms_px(self) -> float:
        """Root mean square distance of the pairs, in reference pixels."""
        return self.evidence.rms_px

    @property
    def agreement(self) -> float:
        """Share of the minutiae inside the common region that are paired."""
        return self.evidence.agreement

    @property
    def overlap(self) -> float:
        """Share of the smaller print that lies inside the other's region."""
        return self.evidence.overlap

    @property
    def reason(self) -> str:
        """What is missing for a decision, or the main reason for a non-match; "" for a match."""
        if self.match:
            return ""
        why = self.evidence.reason if self.shortage is None else self.shortage.message
        score = None if self.explanation is None else self.explanation.mirrored_score
        return why if score is None else f"{why}; {MIRRORED.format(score)}"

    @property
    def compared(self) -> Compared | None:
        """How much was compared; None where the matcher does not give it."""
        return self.evidence.compared

    @property
    def ridge_map(self) -> RidgeMap | None:
        """Where the ridges agree; None where they were not compared. Its mean is scored."""
        return None if self.explanation is None else self.explanation.ridge_map

    @property
    def matched_share(self) -> float:
        """Pairs over minutiae of the template that has fewer; 0 where it has none."""
        fewest = min(len(self.probe.minutiae), len(self.reference.minutiae))
        return len(self.pairs) / fewest if fewest else 0.0

    @property
    def extrapolated(self) -> bool:
        """Whether the FMR lies beyond what the calibration data could measure."""
        return self.fmr < self.smallest_measured_fmr


def find_scale(verification: Verification) -> ScaleMeasurement | None:
    """Find the scale between the prints of a verification, whether they match or not.

    Where they match, it is that of their pairs. Where they do not, the probe is compared at the
    other scales that are possible; one at which the prints match is a reason for the no (never a
    yes). Where a share of pairs decided, which no scale changes, none is tried. A scale that
    differs is measured again with the resolutions corrected: otherwise pairs far from the middle
    are lost.

    Parameters
    ----------
    verification : Verification
        What ``fpmatch.verify`` returned.

    Returns
    -------
    ScaleMeasurement or None
        None where no scale can be measured.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template, find_scale, verify
    >>> empty = Template(Minutiae.empty(), width=300, height=300)
    >>> find_scale(verify(empty, empty)) is None
    True
    """
    v = verification
    if v.match:
        measured = measure_scale(v.probe, v.reference, v.pairs)
        if measured is None or abs(math.log(measured.ratio)) < SMALL_LOG_DIFFERENCE:
            return measured
        return _refined(v, measured.ratio) or measured
    if v.rho is not None or v.explanation is None:
        return None
    needed = v.threshold + allowance(1.0, len(CANDIDATE_RATIOS))  # for so many tries
    possible = [ratio for ratio in CANDIDATE_RATIOS if _at_scale(v.probe, ratio)]
    tries = [
        (v.explanation.score_at_scale(rescaled), ratio)
        for ratio in v.explanation.possible_scales(possible)
        if (rescaled := _at_scale(v.probe, ratio))
    ]
    score, ratio = max(tries, default=(-math.inf, 1.0))
    return _refined(v, ratio) if score >= needed else None


def _refined(verification: Verification, ratio: float) -> ScaleMeasurement | None:
    """Measure a scale that is `ratio`, roughly; None where it turns out to be 1."""
    v, measured = verification, None
    if v.explanation is None or wants_image(v.explanation.matcher):
        return None
    for _ in range(REFINEMENTS):
        rescaled = _at_scale(v.probe, ratio)
        if rescaled is None:
            return None
        pairs = v.explanation.pairs_at_scale(rescaled)
        refined = measure_scale(rescaled, v.reference, pairs)
        if refined is None:
            return None
        ratio *= refined.ratio
        measured = assessed(ratio, ratio / refined.ratio * refined.error)
    return measured if measured is not None and measured.differs else None


def _at_scale(probe: Template, ratio: float) -> Template | None:
    """Return a print whose lengths are `ratio` times as long; None where that cannot be."""
    dpi = probe.dpi / ratio
    return replace(probe, dpi=dpi) if MIN_DPI <= dpi <= MAX_DPI else None
