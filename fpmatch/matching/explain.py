"""The reasons why two prints do not match, as texts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching.align import aligner_of, hypotheses

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from fpmatch.matching.align import Alignment
    from fpmatch.matching.prepare import PreparedTemplate
    from fpmatch.matching.score import Evidence


@dataclass(frozen=True, slots=True)
class ExplanationParameters:
    """Thresholds for the reasons; lengths in pixels at 500 dpi.

    Parameters
    ----------
    small_overlap : float
        Share of the smaller print below which the common region is small.
    poor_ridges : float
        Correlation below which the ridges disagree: hardly more than that of impostor prints.
    poor_minutiae : float
        Mean quality of a print's minutiae, 0 to 1, below which they are poor.
    apart_px : float
        Mean distance between the images of a print under two transforms from which they compete.
    competing_share : float
        Least share of the pairs of the best transform that a competing transform has.
    """

    small_overlap: float = 0.25
    poor_ridges: float = 0.3
    poor_minutiae: float = 0.4
    apart_px: float = 30.0
    competing_share: float = 0.75


def explain(
    probe: PreparedTemplate,
    reference: PreparedTemplate,
    evidence: Evidence,
    competing: int = 0,
    parameters: ExplanationParameters | None = None,
) -> str:
    """Return the reasons against one finger as texts, the main one first.

    Parameters
    ----------
    probe, reference : PreparedTemplate
        The two prints.
    evidence : Evidence
        Under the best transform.
    competing : int
        Pairs under another transform; see `competing_pairs`.
    parameters : ExplanationParameters, optional
        Thresholds.

    Returns
    -------
    str
        One line.
    """
    p = parameters or ExplanationParameters()
    parts = [main_reason(evidence, p)]
    if 0 < p.competing_share * evidence.pairs <= competing:
        parts.append(f"a quite different transform pairs {competing}: neither stands out")
    return "; ".join([*parts, *_poor_sides(probe, reference, p)])


def competing_pairs(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    similarity: NDArray[np.float32],
    parameters: ExplanationParameters | None = None,
) -> int:
    """Count the pairs under the best transform that maps print A to a quite different place.

    Parameters
    ----------
    a, b : PreparedTemplate
        Two prints, in the order of their content.
    alignment : Alignment
        The best one.
    similarity : ndarray of float32, shape (N, M)
        Local similarity of their minutiae.
    parameters : ExplanationParameters, optional
        Thresholds.

    Returns
    -------
    int
        0 where no other transform is proposed.
    """
    p = parameters or ExplanationParameters()
    best = _mapped(a.points, alignment.transform)
    # a minutia is in one local match only: without those of the best, others are found
    other = similarity.copy()
    paired = np.flatnonzero(alignment.partner >= 0)
    other[paired, alignment.partner[paired]] = 0.0
    aligner = aligner_of(a.points, b.points)
    others = [
        one
        for matches in (similarity, other)
        for one in hypotheses(aligner, matches)
        if np.abs(_mapped(a.points, one.transform) - best).mean() > p.apart_px
    ]
    return max((int(np.count_nonzero(one.partner >= 0)) for one in others), default=0)


def _mapped(points: NDArray[np.float64], transform: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return the images of minutiae under a transform, as complex numbers."""
    c, s, x, y = transform.tolist()
    return np.asarray((points[0] + 1j * points[1]) * complex(c, s) + complex(x, y))


def main_reason(evidence: Evidence, parameters: ExplanationParameters | None = None) -> str:
    """Return the main reason against one finger, by the evidence of the score."""
    p = parameters or ExplanationParameters()
    pairs = "1 pair" if evidence.pairs == 1 else f"{evidence.pairs} pairs"
    share = f"{pairs} among {evidence.common} minutiae in the common region"
    if evidence.overlap < p.small_overlap:
        return f"the common region is small ({evidence.overlap:.0%} of the smaller print): {share}"
    if evidence.cells and evidence.ridges < p.poor_ridges:
        return f"the ridges disagree under the best transform: {share}"
    return f"too few minutiae agree under the best transform: {share}"


def _poor_sides(
    probe: PreparedTemplate, reference: PreparedTemplate, p: ExplanationParameters
) -> Iterator[str]:
    for name, side in (("probe", probe), ("reference", reference)):
        mean = float(side.quality.mean())
        if mean < p.poor_minutiae:
            yield f"the minutiae of the {name} are poor (mean quality {100 * mean:.0f})"
