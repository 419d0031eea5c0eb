"""Verification: two templates become a decision, with all that explains it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.plugins import call_matcher
from fpmatch.matching.calibration import allowance as allowance_of
from fpmatch.matching.calibration import score_to_fmr
from fpmatch.matching.decision import Reachable, Rule, find_reachable, find_shortage
from fpmatch.matching.registry import DEFAULT_MATCHER
from fpmatch.matching.result import (
    INCONCLUSIVE,
    MATCH,
    NO_MATCH,
    Shortage,
    compare_prepared,
)
from fpmatch.matching.scale import find_scale, measure_scale
from fpmatch.templates.bounds import have_same_minutiae

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.calibration import Calibration
    from fpmatch.matching.reference.ridges import RidgeMap
    from fpmatch.matching.result import Compared, Comparison, Decision, Identity, Matcher, Side
    from fpmatch.matching.scale import ScaleMeasurement
    from fpmatch.pointset.geometry.similarity import Similarity
    from fpmatch.templates.minutiae import Template

MIRRORED_SHARE: Final = 0.5  # of the false match rate, for the tries of a mirrored probe
MIRRORED: Final = (
    "mirrored, the probe matches, with a score of {:.1f}: is one of the images mirrored? "
    "(--mirror flips the probe)"
)


@dataclass(frozen=True, eq=False)
class Verification:
    """The decision on two templates and the evidence for it; equal to itself alone.

    All is known when it is made, but for the map of the ridges, a picture, and the reachable score,
    which are made when they are first read.

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
    probe, reference : Template
        The two templates compared.
    similarity : float
        The matcher's raw similarity.
    transform : Similarity or None
        Maps the probe's pixels onto the reference's, for a non-match as well as can be; None where
        no transform was found.
    pairs : ndarray of int32, shape (K, 2)
        Indices (probe minutia, reference minutia), one-to-one, sorted by the first.
    rms_px : float
        Root mean square distance of the pairs after the transform, in reference pixels.
    agreement : float
        Share (0..1) of the minutiae inside the common region that are paired.
    overlap : float
        Share (0..1) of the smaller print that lies inside the other's region.
    compared : Compared or None
        How much was compared; None where the matcher does not measure it.
    reason : str
        What is missing for a decision, or the main reason for a non-match; "" for a match.
    shortage : Shortage or None
        What the prints lack for a decision; None for a match, and where they lack nothing.
    scale : ScaleMeasurement or None
        Scale between the prints; see `fpmatch.matching.scale`.
    smallest_measured_fmr : float
        Smallest FMR that the calibration data measure; a lower `fmr` is extrapolated.
    rho : float or None
        Where the matcher decided by the share of minutiae that are paired: the share that is not
        enough for a match. None where the score decided.
    dpi_assumed : tuple of str
        The sides, "probe" and "reference", whose resolution neither a file nor the caller states.
    identical : str or None
        What of the two prints is the same: "pixels" of their images, or "template"; None where
        they differ. Else an impression is compared with itself, and `fmr` states no rate.
    images : tuple of ndarray or None
        Pixels of probe and reference; None for a template.
    map_ridges, find_reachable : callable or None
        Make `ridge_map` and `reachable_score`.
    """

    match: bool
    score: float
    fmr: float
    threshold: float
    matcher: str
    probe: Template = field(repr=False)
    reference: Template = field(repr=False)
    similarity: float = field(default=0.0, repr=False)
    transform: Similarity | None = field(default=None, repr=False)
    pairs: NDArray[np.int32] = field(default_factory=lambda: np.empty((0, 2), np.int32), repr=False)
    rms_px: float = field(default=0.0, repr=False)
    agreement: float = field(default=0.0, repr=False)
    overlap: float = field(default=0.0, repr=False)
    compared: Compared | None = field(default=None, repr=False)
    reason: str = field(default="", repr=False)
    shortage: Shortage | None = field(default=None, repr=False)
    scale: ScaleMeasurement | None = field(default=None, repr=False)
    smallest_measured_fmr: float = 0.0
    rho: float | None = None
    dpi_assumed: tuple[str, ...] = ()
    identical: Identity | None = None
    images: tuple[NDArray[np.uint8] | None, ...] = field(default=(None, None), repr=False)
    map_ridges: Callable[[], RidgeMap | None] | None = field(default=None, repr=False)
    find_reachable: Callable[[], Reachable] | None = field(default=None, repr=False)

    @property
    def decision(self) -> Decision:
        """The outcome: "match", "no match" or "inconclusive"; the last where evidence lacks."""
        if self.match:
            return MATCH
        return NO_MATCH if self.shortage is None else INCONCLUSIVE

    @property
    def matched_share(self) -> float:
        """Pairs over minutiae of the template that has fewer; 0 where it has none."""
        fewest = min(len(self.probe.minutiae), len(self.reference.minutiae))
        return len(self.pairs) / fewest if fewest else 0.0

    @property
    def extrapolated(self) -> bool:
        """Whether the FMR lies beyond what the calibration data could measure."""
        return self.fmr < self.smallest_measured_fmr

    @cached_property
    def reachable_score(self) -> float | None:
        """Score that half of the genuine comparisons of as much skin reach; None if unknown."""
        score = math.inf if self.find_reachable is None else self.find_reachable().score
        return score if math.isfinite(score) else None

    @cached_property
    def ridge_map(self) -> RidgeMap | None:
        """Where the ridges agree; None where they were not compared. Its mean is scored."""
        return None if self.map_ridges is None else self.map_ridges()


def verify(
    probe: Template,
    reference: Template,
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    threshold: float | None = None,
    calibration: Calibration | None = None,
    images: Sequence[NDArray[np.uint8] | None] = (None, None),
    allowance: float = 0.0,
    dpi_assumed: tuple[str, ...] = (),
) -> Verification:
    """Decide whether two templates come from the same finger; see `fpmatch.verify`.

    The one function that does so: `fpmatch.verify`, the commands and the web interface call it.
    The `images`, where there are any, tell whether one is compared with itself. A score that
    decides is lowered by `allowance`, for one of several tries. The resolutions of the sides
    `dpi_assumed` are not stated anywhere.
    """
    rule = Rule.of(matcher, threshold, calibration)
    ours, theirs = (call_matcher(rule.matcher, "prepare", one) for one in (probe, reference))
    comparison = compare_prepared(rule.matcher, ours, theirs)
    score = rule.score(comparison.similarity)
    if allowance and rule.rho is None:
        score = max(0.0, score - allowance)
    return decide(
        rule,
        (probe, ours),
        (reference, theirs),
        comparison,
        score,
        images=images,
        dpi_assumed=dpi_assumed,
    )


def decide(
    rule: Rule,
    probe: Side,
    reference: Side,
    comparison: Comparison,
    score: float,
    *,
    impressions: Sequence[Side] = (),
    images: Sequence[NDArray[np.uint8] | None] = (None, None),
    dpi_assumed: tuple[str, ...] = (),
) -> Verification:
    """Return the decision on two prints, or on a probe and a finger, that have this score.

    Of a finger all `impressions` are given; `reference` is the most similar of them. `images` are
    the pixels of probe and reference.
    """
    matcher, curve = rule.matcher, rule.calibration
    match = rule.is_match(comparison, score)
    both = probe[1], reference[1]
    evidence = comparison if match else call_matcher(matcher, "explain", *both, comparison)
    references = impressions or [reference]
    reach = partial(find_reachable, matcher, curve, probe, references)
    shortage, reason = None, ""
    if match:
        scale = measure_scale(probe[0], reference[0], evidence.pairs)
    else:
        scale = find_scale(rule, probe, reference)
        known = reach()
        reach = partial(Reachable, *known)
        shortage = find_shortage(matcher, curve, known, rule.threshold)
        if dpi_assumed and scale is not None:
            sides = " and ".join(f"the {side}" for side in dpi_assumed)
            message = f"the resolution of {sides} is unknown, and at another one the prints match"
            shortage = Shortage("unknown resolution", message)
        reason = shortage.message if shortage else evidence.reason or "too little agrees"
        if (mirrored := _mirrored_score(rule, probe[0], references)) is not None:
            reason += f"; {MIRRORED.format(mirrored)}"
    identical: Identity | None = None
    ours, theirs = images
    if ours is not None and theirs is not None and np.array_equal(ours, theirs):
        identical = "pixels"
    elif have_same_minutiae(probe[0], reference[0]):
        identical = "template"
    return Verification(
        match=match,
        score=score,
        fmr=math.nan if curve is None else score_to_fmr(score),
        threshold=rule.threshold,
        matcher=matcher.name,
        probe=probe[0],
        reference=reference[0],
        similarity=comparison.similarity,
        transform=evidence.transform,
        pairs=evidence.pairs,
        rms_px=evidence.rms_px,
        agreement=evidence.agreement,
        overlap=evidence.overlap,
        compared=None if impressions else evidence.compared,
        reason=reason,
        shortage=shortage,
        scale=scale,
        smallest_measured_fmr=0.0 if curve is None else score_to_fmr(curve.knots[-1][1]),
        rho=rule.rho,
        dpi_assumed=dpi_assumed,
        identical=identical,
        images=tuple(images),
        map_ridges=evidence.ridge_map,
        find_reachable=reach,
    )


def _mirrored_score(rule: Rule, probe: Template, references: Sequence[Side]) -> float | None:
    """Return the score of the mirrored probe, less what its tries cost; None for no match."""
    if rule.rho is not None:
        return None
    mirrored = call_matcher(rule.matcher, "prepare", probe.mirrored())
    tried = [compare_prepared(rule.matcher, one, mirrored) for _, one in references]
    best = max(tried, key=lambda one: one.similarity)
    score = rule.score(best.similarity) - allowance_of(MIRRORED_SHARE, len(tried))
    return score if rule.is_match(best, score) else None
