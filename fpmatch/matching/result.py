"""What a matcher is, and what its comparison of two templates yields."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from fpmatch.base.parameters import changed_parameters, with_parameters
from fpmatch.base.plugins import PLUG_IN, call_matcher, is_own
from fpmatch.errors import MatcherError
from fpmatch.pointset.geometry.similarity import Similarity

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeAlias

    from numpy.typing import NDArray

    from fpmatch.matching.reference.ridges import RidgeMap
    from fpmatch.templates.minutiae import Template

    Side: TypeAlias = tuple[Template, Any]  # a template, and what the matcher prepared of it


Decision = Literal["match", "no match", "inconclusive"]
MATCH: Final = "match"
NO_MATCH: Final = "no match"
INCONCLUSIVE: Final = "inconclusive"

Identity = Literal["pixels", "template"]  # what of two prints is the same

_NO_PAIRS: Final = np.empty((0, 2), np.int32)


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


@dataclass(slots=True, eq=False)  # not frozen: that takes a microsecond, as long as the prefilter
class Comparison:
    """A matcher's own result, before calibration; equal to itself alone.

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
        Share (0..1) of the smaller print that lies inside the other's region; 0 where the matcher
        measures neither this nor the agreement.
    reason : str
        The main reason against one finger, or why nothing was found; "" if the matcher gives none.
    compared : Compared or None
        How much was compared; None where that is unknown.
    detail : object
        The matcher's own record of the comparison.
    """

    similarity: float
    transform: Similarity | None
    pairs: NDArray[np.int32]
    rms_px: float
    agreement: float = 0.0
    overlap: float = 0.0
    reason: str = ""
    compared: Compared | None = None
    detail: Any = field(default=None, repr=False)

    def ridge_map(self) -> RidgeMap | None:
        """Return where the ridges agree; None where they were not compared."""
        return None


def nothing_found(reason: str, similarity: float = 0.0) -> Comparison:
    """Return the comparison of prints of which nothing is paired."""
    return Comparison(similarity, None, _NO_PAIRS, 0.0, reason=reason)


class Matcher(ABC):
    """Compare templates: the base class of every matcher, of this package and of others.

    A subclass defines `name`, `prepare` and `compare`; all else has a default. `prepare` does once
    per template what does not depend on the other side; `compare` takes two prepared templates. It
    must be symmetric: exchanging the two sides gives the same similarity to the last bit and the
    inverse transform. A matcher that explains its answers defines `explain`; one that estimates
    what prints can reach defines `amount` and `typical_similarities`.

    Parameters
    ----------
    **given : int, float or str
        Values of entries of the dataclass `parameters`. Those that differ from the defaults become
        part of `name`, so that no score, calibration or file is taken for that of a matcher with
        other parameters.

    Attributes
    ----------
    name : str
        Name of the matcher.
    parameters : dataclass or None
        The defaults, a frozen dataclass of `fpmatch.base.parameters.parameter`; None without any.
    rho : float or None
        Where the similarity is the share of minutiae of the smaller template that are paired, and
        more than so many are a match if no threshold is given.

    Raises
    ------
    MatcherError
        If there is no such parameter, or a value is of another kind or out of range.

    Examples
    --------
    >>> from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
    >>> UnitCircleMatcher(rounds=5, reach_px=10.0).name
    'unit-circle:rounds=5'
    """

    name: str
    parameters: Any = None
    rho: float | None = None

    def __init__(self, **given: float | str) -> None:
        if given:
            usual, own = self.parameters, self.name
            parameters = with_parameters(usual, given, f"matcher {own}")
            if changed := changed_parameters(usual, parameters):
                self.parameters, self.name = parameters, f"{own}:{changed}"

    @abstractmethod
    def prepare(self, template: Template) -> Any:
        """Return what `compare` needs of one template."""

    @abstractmethod
    def compare(self, probe: Any, reference: Any) -> Comparison:
        """Compare two prepared templates."""

    def explain(self, probe: Any, reference: Any, comparison: Comparison) -> Comparison:
        """Return a comparison under its best transform, with the reason against one finger."""
        return comparison

    def amount(self, prepared: Any, factor: float = 1.0) -> NDArray[np.float64] | None:
        """Return the evidence in a print with `factor` times as much skin; None if unknown.

        The first two of its five numbers are minutiae and area, in square pixels at 500 dpi.
        """
        return None

    def typical_similarities(
        self, probe: NDArray[np.float64], references: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the median similarities of genuine prints, by amounts of evidence (..., 5)."""
        return np.full(np.broadcast_shapes(probe.shape, references.shape)[:-1], math.inf)

    def possible_scales(self, probe: Any, reference: Any, ratios: Sequence[float]) -> list[float]:
        """Return those of `ratios` by which the probe's lengths may be wrong."""
        return list(ratios)


def compare_prepared(matcher: Matcher, probe: Any, reference: Any) -> Comparison:
    """Compare two prepared templates; raise MatcherError where a plug-in answers wrongly."""
    if is_own(matcher):
        return matcher.compare(probe, reference)
    comparison: Comparison = call_matcher(matcher, "compare", probe, reference)
    if wrong := _what_is_wrong(comparison):
        raise MatcherError(f"matcher {matcher.name}: compare returned {wrong}", code=PLUG_IN)
    return comparison


def _what_is_wrong(comparison: Any) -> str:
    """Return what is wrong with what a plug-in returned as a comparison; "" where nothing is."""
    if not isinstance(comparison, Comparison):
        return f"{type(comparison).__name__}, not Comparison"
    names = "similarity", "transform", "pairs"
    similarity, transform, pairs = (getattr(comparison, name) for name in names)
    if not isinstance(similarity, int | float | np.number):
        return f"a similarity that is {type(similarity).__name__}, not a number"
    if not (math.isfinite(similarity) and similarity >= 0):
        return f"a similarity of {float(similarity)!r}, where it is 0 or more"
    if not isinstance(transform, Similarity | None):
        return f"a transform that is {type(transform).__name__}, not Similarity or None"
    whole = isinstance(pairs, np.ndarray) and pairs.dtype.kind in "iu"
    return "" if whole and pairs.shape[1:] == (2,) else "pairs that are not indices (K, 2)"
