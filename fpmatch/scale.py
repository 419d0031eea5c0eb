"""Whether two prints are of one scale, as they are where both resolutions are right.

A print of 569 dots per inch that is taken for 500 looks larger than it is, by 14 %. Two
impressions of one finger differ by 2 % in general, by 5 % rarely, and by 9 % hardly ever, where the
skin was stretched on purpose. Where paired minutiae tell more, a resolution is likely wrong.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from fpmatch.minutiae import MAX_DPI, MIN_DPI

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from fpmatch.minutiae import Template

MM_PER_INCH: Final = 25.4


@dataclass(frozen=True, slots=True)
class ScaleParameters:
    """Set when two scales are taken to differ.

    Parameters
    ----------
    min_pairs : int
        Pairs of minutiae below which no scale is measured.
    max_difference : float
        Ratio of the scales, less 1, up to which they count as one.
    errors : float
        Standard errors that the ratio must lie beyond that.
    tried : tuple of float
        Ratios that are tried where prints do not match.
    rounds : int
        Times that a scale is measured with the resolutions put right.
    """

    min_pairs: int = 8
    max_difference: float = 0.07
    errors: float = 3.0
    tried: tuple[float, ...] = (0.5, 0.63, 0.79, 0.89, 1.12, 1.26, 1.59, 2.0)
    rounds: int = 2


@dataclass(frozen=True, slots=True)
class ScaleMeasurement:
    """Hold how much larger the reference is than the probe, at the resolutions that they claim.

    Parameters
    ----------
    ratio : float
        Lengths in the reference over the same in the probe, in millimetres; 1 where both
        resolutions are right.
    error : float
        Standard error of `ratio`.
    differs : bool
        Whether `ratio` is certainly not 1, skin being what it is.
    """

    ratio: float
    error: float
    differs: bool


class Decision(Protocol):
    """Tell what `find_scale` needs of a decision: `fpmatch.Verification` does."""

    @property
    def match(self) -> bool:
        """Whether the prints match."""

    @property
    def score(self) -> float:
        """``-10·log10`` of the false match rate."""

    @property
    def threshold(self) -> float:
        """The score of a match."""

    @property
    def pairs(self) -> NDArray[np.int32]:
        """Pairs of minutiae, shape (K, 2)."""

    @property
    def probe(self) -> Template:
        """The probe."""

    @property
    def reference(self) -> Template:
        """The reference."""


def measure_scale(
    probe: Template,
    reference: Template,
    pairs: NDArray[np.integer],
    parameters: ScaleParameters | None = None,
) -> ScaleMeasurement | None:
    """Measure the scale between two prints by their paired minutiae.

    Parameters
    ----------
    probe, reference : Template
        The two prints; their resolutions turn pixels into millimetres.
    pairs : ndarray of int, shape (K, 2)
        Indices of minutiae of the probe and the reference, one-to-one.
    parameters : ScaleParameters, optional
        When the scales are taken to differ.

    Returns
    -------
    ScaleMeasurement or None
        None where there are too few pairs, or all lie in one place.

    Examples
    --------
    >>> from fpmatch.minutiae import Minutiae, Template
    >>> x, y = np.meshgrid(np.arange(0, 100, 25.0), np.arange(0, 100, 25.0))
    >>> minutiae = Minutiae(x.ravel(), y.ravel(), np.zeros(16))
    >>> right = Template(minutiae, width=100, height=100, dpi=569)
    >>> wrong = Template(minutiae, width=100, height=100, dpi=500)
    >>> scale = measure_scale(wrong, right, np.column_stack([np.arange(16)] * 2))
    >>> round(scale.ratio, 3), scale.differs
    (0.879, True)
    """
    p = parameters or ScaleParameters()
    if len(pairs) < p.min_pairs:
        return None
    a = _places_in_mm(probe, pairs[:, 0])
    b = _places_in_mm(reference, pairs[:, 1])
    spread_a, spread_b = float((np.abs(a) ** 2).sum()), float((np.abs(b) ** 2).sum())
    together = float(abs(np.vdot(a, b)))
    if not (spread_a > 0 and spread_b > 0 and together > 0):
        return None
    # Of the fits of B to A and of A to B, which noise shrinks alike, the one between them.
    ratio = math.sqrt(spread_b / spread_a)
    coherence = min(together / math.sqrt(spread_a * spread_b), 1.0)
    error = ratio * math.sqrt((1 - coherence**2) / (2 * (len(pairs) - 2)))
    return _judged(ratio, error, p)


def find_scale(
    decision: Decision,
    verify: Callable[[Template, Template], Decision],
    parameters: ScaleParameters | None = None,
) -> ScaleMeasurement | None:
    """Find the scale between the prints of a verification, whether they match or not.

    Where they match, it is that of their pairs. Where they do not, other scales are tried, and
    one at which they do match is a reason for the no (never a yes). A scale that differs is
    measured again with the resolutions put right, for pairs far from the middle get lost
    otherwise.

    Parameters
    ----------
    decision : Decision
        What ``fpmatch.verify`` returned of two prints.
    verify : callable
        The function that returned it, of the same two arguments.
    parameters : ScaleParameters, optional
        When the scales are taken to differ, and which ones are tried.

    Returns
    -------
    ScaleMeasurement or None
        None where nothing can be said.

    Examples
    --------
    >>> from fpmatch import Minutiae, Template, verify
    >>> empty = Template(Minutiae.empty(), width=300, height=300)
    >>> find_scale(verify(empty, empty), verify) is None
    True
    """
    p = parameters or ScaleParameters()
    probe, reference = decision.probe, decision.reference
    if decision.match:
        measured = measure_scale(probe, reference, decision.pairs, p)
        if measured is None or abs(math.log(measured.ratio)) < math.log1p(p.max_difference / 2):
            return measured
        return _refined(probe, reference, measured.ratio, verify, p) or measured
    needed = decision.threshold + 10.0 * math.log10(max(1, len(p.tried)))  # for so many tries
    tries = [(verify(at, reference).score, k) for k in p.tried if (at := _at_scale(probe, k))]
    score, ratio = max(tries, default=(-math.inf, 1.0))
    return _refined(probe, reference, ratio, verify, p) if score >= needed else None


def _refined(
    probe: Template,
    reference: Template,
    ratio: float,
    verify: Callable[[Template, Template], Decision],
    p: ScaleParameters,
) -> ScaleMeasurement | None:
    """Measure a scale that is `ratio`, roughly; None where it turns out to be 1."""
    measured = None
    for _ in range(p.rounds):
        rescaled = _at_scale(probe, ratio)
        if rescaled is None:
            return None
        found = measure_scale(rescaled, reference, verify(rescaled, reference).pairs, p)
        if found is None:
            return None
        ratio *= found.ratio
        measured = _judged(ratio, ratio / found.ratio * found.error, p)
    return measured if measured is not None and measured.differs else None


def _at_scale(probe: Template, ratio: float) -> Template | None:
    """Return a print whose lengths are `ratio` times as long; None where that cannot be."""
    dpi = probe.dpi / ratio
    return replace(probe, dpi=dpi) if MIN_DPI <= dpi <= MAX_DPI else None


def _judged(ratio: float, error: float, p: ScaleParameters) -> ScaleMeasurement:
    beyond = abs(math.log(ratio)) - p.errors * error / ratio
    return ScaleMeasurement(ratio, error, differs=beyond > math.log1p(p.max_difference))


def _places_in_mm(template: Template, index: NDArray[np.integer]) -> NDArray[np.complex128]:
    """Return the places of some minutiae about their middle, as complex numbers."""
    minutiae = template.minutiae
    places = minutiae.x[index].astype(np.float64) + 1j * minutiae.y[index].astype(np.float64)
    from_middle: NDArray[np.complex128] = places - places.mean()
    return from_middle * (MM_PER_INCH / template.dpi)
