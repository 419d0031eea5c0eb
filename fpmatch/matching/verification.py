"""Verification: the decision on two templates and the evidence for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.result import INCONCLUSIVE, MATCH, NO_MATCH

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.matching.decision import Reachable
    from fpmatch.matching.reference.ridges import RidgeMap
    from fpmatch.matching.result import Compared, Decision, Identity, Shortage
    from fpmatch.matching.scale import ScaleMeasurement
    from fpmatch.pointset.geometry.similarity import Similarity
    from fpmatch.templates.minutiae import Template


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
