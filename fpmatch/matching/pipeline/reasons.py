"""The reasons why two prints do not match, as texts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.pipeline.alignment import aligner_of, hypotheses
from fpmatch.matching.pipeline.evidence import main_reason
from fpmatch.matching.pipeline.parameters import USUAL
from fpmatch.printable import count

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.pipeline.alignment import Alignment
    from fpmatch.matching.pipeline.evidence import Evidence
    from fpmatch.matching.pipeline.parameters import MatchParameters
    from fpmatch.matching.prints.prepared import PreparedTemplate


POOR_MINUTIAE: Final = 0.4  # mean quality of a print's minutiae, 0 to 1
APART_PX: Final = 30.0  # at 500 dpi, between the images of a print under competing transforms
COMPETING_SHARE: Final = 0.75  # of the pairs of the best transform, that a competing one has


def all_reasons(
    probe: PreparedTemplate, reference: PreparedTemplate, evidence: Evidence, competing: int = 0
) -> str:
    """Return the reasons against one finger in one line, the main one first.

    The evidence is that under the best transform; `competing_pairs` counts those of another.
    """
    parts = [main_reason(evidence)]
    if 0 < COMPETING_SHARE * evidence.pairs <= competing:
        parts.append(
            f"another, very different transform pairs {count(competing, 'minutia', 'minutiae')}: "
            "the alignment is ambiguous"
        )
    for name, side in (("probe", probe), ("reference", reference)):
        mean = float(side.quality.mean())
        if mean < POOR_MINUTIAE:
            parts.append(f"the minutiae of the {name} are poor (mean quality {100 * mean:.0f})")
    return "; ".join(parts)


def competing_pairs(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    similarity: NDArray[np.float32],
    apart_px: float = APART_PX,
    parameters: MatchParameters = USUAL,
) -> int:
    """Count the pairs under the best transform that maps print A to a very different place.

    The prints are in the order of their content, `alignment` is the best one, and `similarity`
    (N, M) the local similarity of their minutiae.
    """
    best = _mapped(a.points, alignment.transform)
    # a minutia is in one local match only: without those of the best, others are found
    other = similarity.copy()
    paired = np.flatnonzero(alignment.partner >= 0)
    other[paired, alignment.partner[paired]] = 0.0
    aligner = aligner_of(a.points, b.points, parameters)
    return max(
        (
            int(np.count_nonzero(one.partner >= 0))
            for matches in (similarity, other)
            for one in hypotheses(aligner, matches)
            if np.abs(_mapped(a.points, one.transform) - best).mean() > apart_px
        ),
        default=0,
    )


def _mapped(points: NDArray[np.float64], transform: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return the images of minutiae under a transform, as complex numbers."""
    c, s, x, y = transform.tolist()
    return np.asarray((points[0] + 1j * points[1]) * complex(c, s) + complex(x, y))
