"""What a comparison of two templates yields: `Comparison` (a matcher's) and `Verification`."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal, Protocol, runtime_checkable

import numpy as np

from fpmatch.matching.scale import find_scale

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.pipeline.ridge_map import RidgeMap
    from fpmatch.matching.scale import ScaleMeasurement
    from fpmatch.matching.verify import Explanation
    from fpmatch.pointset.geometry.similarity import Similarity
    from fpmatch.templates.minutiae import Template


Decision = Literal["match", "no match", "inconclusive"]
MATCH: Final = "match"
NO_MATCH: Final = "no match"
INCONCLUSIVE: Final = "inconclusive"

UNKNOWN_RESOLUTION: Final = "unknown resolution"  # a code of `Shortage`


@dataclass(frozen=True, slots=True)
class Shortage:
    """What two prints lack for a decision: a code of `decision`, and the reason in words."""

    code: str
    message: str


@dataclass(frozen=True, slots=True)
class Compared:
    """The amount of two prints that was compared, and the agreement of their ridges."""

    minutiae: int  # of both prints in the common region, paired or not
    area_mm2: float  # of the common region
    ridge_agreement: float | None  # mean correlation, -1 to 1; None where they were not compared
    ridge_area_mm2: float  # on which the ridges were compared
    ridge_score: float  # about what the ridges add to the score; 0 where they were not compared


@dataclass(frozen=True, slots=True)
class Comparison:
    """A matcher's own result, before calibration.

    Parameters
    ----------
    similarity : float
        The matcher's raw similarity, 0 for nothing in common; only its order has meaning.
    transform : Similarity or None
        Maps the probe's pixels onto the reference's; None where no transform was found.
    pairs : ndarray of int32, shape (K, 2)
        Indices (probe minutia, reference minutia), one-to-one, sorted by the first.
    rms_px : float
        Root mean square distance of the pairs after the transform, in reference pixels.
    agreement : float
        Share (0..1) of the minutiae inside the common region that are paired.
    overlap : float
        Share (0..1) of the smaller print that lies inside the other's region.
    reason : str
        The main reason against one finger, or why nothing was found; "" if the matcher gives none.
    compared : Compared or None
        How much was compared, where it was computed.
    detail : object
        The matcher's own record of the comparison.
    """

    similarity: float
    transform: Similarity | None
    pairs: NDArray[np.int32]
    rms_px: float
    agreement: float
    overlap: float
    reason: str = ""
    compared: Compared | None = None
    detail: Any = field(default=None, repr=False, compare=False)


def nothing_found(reason: str, similarity: float = 0.0) -> Comparison:
    """Return the comparison of prints of which nothing is paired."""
    return Comparison(similarity, None, np.empty((0, 2), np.int32), 0.0, 0.0, 0.0, reason)


class Matcher(Protocol):
    """Compare templates; a new matcher is one module that defines ``MATCHER`` of this shape.

    `prepare` does once per template what does not depend on the other side; `compare` takes two
    prepared templates. `compare` must be symmetric: exchanging the two sides gives the same
    similarity to the last bit and the inverse transform.
    """

    @property
    def name(self) -> str:
        """Name of the matcher."""

    def prepare(self, template: Template) -> Any:
        """Return what `compare` needs of one template."""

    def compare(self, probe: Any, reference: Any) -> Comparison:
        """Compare two prepared templates."""


class Explaining(Protocol):
    """Explain a comparison: why there is no match, how much was compared, how much is needed."""

    def explain(self, probe: Any, reference: Any, comparison: Comparison) -> Comparison:
        """Return a comparison under its best transform, with all reasons against one finger."""

    def compared(self, probe: Any, reference: Any, comparison: Comparison) -> Compared | None:
        """Return how much was compared; None where nothing was aligned."""

    def available(self, probe: Any, reference: Any) -> tuple[int, float]:
        """Return minutiae and area in mm² of the smaller of two prepared templates."""

    def amount(self, prepared: Any, factor: float = 1.0) -> NDArray[np.float64]:
        """Return the amount of evidence in a print with `factor` times as much skin."""

    def typical_similarities(
        self, probe: NDArray[np.float64], references: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the median similarities of genuine prints, by the amounts of evidence in them."""

    def possible_scales(self, probe: Any, reference: Any, ratios: Sequence[float]) -> list[float]:
        """Return those of `ratios` by which the probe's lengths may be wrong."""


@runtime_checkable
class DecidesByShare(Protocol):
    """Decide by the share of minutiae that are paired, where no threshold is given.

    The `similarity` of such a matcher is that share, of the smaller template: more than `rho` is
    a match.
    """

    @property
    def rho(self) -> float:
        """Share that must be exceeded."""


def may_match(matcher: Matcher, comparison: Comparison) -> bool:
    """Return whether a comparison can be a match, with a score that is high enough.

    It needs a transform, unless the matcher states by ``aligns = False`` that it finds none.
    """
    return comparison.transform is not None or not getattr(matcher, "aligns", True)


@dataclass(frozen=True)
class Verification:
    """The decision on two templates and the evidence for it.

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
    explanation: Explanation | None = field(default=None, repr=False, compare=False)
    dpi_assumed: tuple[str, ...] = ()

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
        return self.evidence.reason if self.shortage is None else self.shortage.message

    @property
    def compared(self) -> Compared | None:
        """How much was compared; None where the matcher does not give it."""
        return self.evidence.compared

    @property
    def ridge_map(self) -> RidgeMap | None:
        """Where the ridges agree; None where they were not compared. Its mean is scored."""
        return None if self.explanation is None else self.explanation.ridge_map

    @property
    def mesh_points(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """The pairs where the matcher's mesh has them, in pixels of probe and reference, (K, 2).

        They lie between the minutiae, which are not located exactly, and what their neighbours
        predict. None where the matcher has no mesh.
        """
        return None if self.explanation is None else self.explanation.mesh_points

    @property
    def matched_share(self) -> float:
        """Pairs over minutiae of the template that has fewer; 0 where it has none."""
        fewest = min(len(self.probe.minutiae), len(self.reference.minutiae))
        return len(self.pairs) / fewest if fewest else 0.0

    @property
    def extrapolated(self) -> bool:
        """Whether the FMR lies beyond what the calibration data could measure."""
        return self.fmr < self.smallest_measured_fmr
