"""What a comparison of two templates yields: `Comparison` (a matcher's) and `Verification`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fpmatch.minutiae import Template
    from fpmatch.pointset.similarity import Similarity


@dataclass(frozen=True, slots=True)
class Compared:
    """Hold how much of two prints was compared, and what the ridges said.

    Parameters
    ----------
    minutiae : int
        Minutiae of both prints in the common region, paired or not.
    area_mm2 : float
        Area of the common region.
    ridge_agreement : float or None
        Mean correlation of the ridges, -1 to 1; None where they were not compared.
    ridge_area_mm2 : float
        Area on which the ridges were compared.
    ridge_score : float
        What the ridges add to the score, about, in its units; 0 where they were not compared.
    """

    minutiae: int
    area_mm2: float
    ridge_agreement: float | None
    ridge_area_mm2: float
    ridge_score: float


@dataclass(frozen=True, slots=True)
class Comparison:
    """Hold a matcher's own result, before calibration.

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
        Where nothing was found: why, in words; else "".
    """

    similarity: float
    transform: Similarity | None
    pairs: NDArray[np.int32]
    rms_px: float
    agreement: float
    overlap: float
    reason: str = ""


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


@runtime_checkable
class Explaining(Protocol):
    """Tell more of two prints that do not match than `compare` takes the time to find out."""

    def explain(self, probe: Any, reference: Any) -> Comparison:
        """Return the comparison of two prepared templates, with all there is to say."""


@runtime_checkable
class StatesAmount(Protocol):
    """Tell how much of two prints is compared, and what comparisons of so much usually reach."""

    def compared(self, probe: Any, reference: Any) -> Compared | None:
        """Return how much is compared under the best transform; None without one."""

    def available(self, probe: Any, reference: Any) -> tuple[int, float]:
        """Return minutiae and area in mm2 of the smaller of two prepared templates."""

    def typical_similarity(self, probe: Any, reference: Any, factor: float) -> float:
        """Return what half of the genuine comparisons of `factor` times as much reach."""


@runtime_checkable
class DecidesByShare(Protocol):
    """Decide by the share of minutiae that are paired, where no threshold is given.

    The `similarity` of such a matcher is that share, of the smaller template: more than `rho` is
    a match.
    """

    @property
    def rho(self) -> float:
        """Share that must be exceeded."""


@dataclass(frozen=True, slots=True)
class Verification:
    """Hold the decision on two templates and the evidence for it.

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
    transform, pairs, rms_px, agreement, overlap
        As in `Comparison`.
    reason : str
        Where the answer is no: why, in words; "" for a match.
    probe, reference : Template
        The two templates compared.
    fmr_reach : float
        Lowest FMR that the calibration data measure; a lower `fmr` is extrapolated.
    rho : float or None
        Where the matcher decided by the share of minutiae that are paired: the share that is not
        enough for a match. None where the score decided.
    compared : Compared or None
        How much was compared; None where the matcher does not say.
    """

    match: bool
    score: float
    fmr: float
    threshold: float
    matcher: str
    transform: Similarity | None
    pairs: NDArray[np.int32]
    rms_px: float
    agreement: float
    overlap: float
    reason: str
    probe: Template = field(repr=False)
    reference: Template = field(repr=False)
    fmr_reach: float = 0.0
    rho: float | None = None
    compared: Compared | None = None

    @property
    def matched_share(self) -> float:
        """Pairs over minutiae of the template that has fewer; 0 where it has none."""
        fewest = min(len(self.probe.minutiae), len(self.reference.minutiae))
        return len(self.pairs) / fewest if fewest else 0.0

    @property
    def extrapolated(self) -> bool:
        """Whether the FMR lies beyond what the calibration data could measure."""
        return self.fmr < self.fmr_reach
