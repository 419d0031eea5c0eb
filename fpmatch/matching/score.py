"""Score: the evidence for and against one finger, and the similarity it amounts to."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fpmatch.matching import _evidence_kernel as kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.matching.align import Alignment
    from fpmatch.matching.prepare import PreparedTemplate


@dataclass(frozen=True, slots=True)
class Evidence:
    """Hold what an alignment says of two prints.

    Parameters
    ----------
    pairs : int
        Minutiae paired.
    local : float
        Sum of the local likeness of the pairs.
    circle : float
        Agreement of the pairs' one-rings on the unit circle.
    unpaired : float
        Unpaired minutiae of both prints inside the common region, each counted by its quality.
    common : int
        Minutiae of both prints inside the common region, paired or not.
    orientation : float
        Mean cosine of twice the difference between the ridge orientations over the common region,
        -1 to 1; a neutral value where a side's orientation is unknown.
    overlap : float
        Share of the smaller print that lies in the common region.
    """

    pairs: int
    local: float
    circle: float
    unpaired: float
    common: int
    orientation: float
    overlap: float

    @property
    def agreement(self) -> float:
        """Share of the minutiae inside the common region that are paired."""
        return 2 * self.pairs / self.common if self.common else 0.0


@dataclass(frozen=True, slots=True)
class ScoreParameters:
    """Set how the evidence is weighed: exponents of the terms, and what an empty side counts."""

    local_power: float = 3.0
    circle_power: float = 0.5
    unpaired_power: float = 1.0
    unpaired_offset: float = 2.0
    orientation_weight: float = 1.5
    overlap_weight: float = 1.0
    orientation_doubt_cells: float = 5.0
    unknown_orientation: float = 0.75


def gather_evidence(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    likeness: NDArray[np.float32],
    parameters: ScoreParameters | None = None,
) -> Evidence:
    """Gather the evidence for and against one finger from an alignment of two prints.

    Parameters
    ----------
    a, b : PreparedTemplate
        The two prints.
    alignment : Alignment
        How A lies on B.
    likeness : ndarray of float32, shape (N, M)
        Local likeness of their minutiae.
    parameters : ScoreParameters, optional
        Weighing.

    Returns
    -------
    Evidence
        Pairs, ring and field agreement, and what speaks against.
    """
    p = parameters or ScoreParameters()
    ia = np.flatnonzero(alignment.partner >= 0)
    ib = alignment.partner[ia]
    common_a = b.region.holds(alignment.bent[0], alignment.bent[1])
    common_b = a.region.holds(*_moved_back(b.points, alignment.transform))
    common_a[ia] = True
    common_b[ib] = True
    unpaired_a, unpaired_b = common_a.copy(), common_b.copy()
    unpaired_a[ia] = False
    unpaired_b[ib] = False
    cells, cosines = _field_agreement(a, b, alignment)
    known = a.region.has_flow and b.region.has_flow
    doubt = p.orientation_doubt_cells
    smaller = min(a.region.area, b.region.area)
    na, nb = a.neighbourhoods, b.neighbourhoods
    return Evidence(
        pairs=len(ia),
        local=float(likeness[ia, ib].sum(dtype=np.float64)),
        circle=kernel.ring_agreement(
            alignment.partner,
            na.ring_start,
            na.ring,
            na.circle,
            nb.ring_start,
            nb.ring,
            nb.circle,
        ),
        unpaired=float(a.quality[unpaired_a].sum() + b.quality[unpaired_b].sum()),
        common=int(common_a.sum() + common_b.sum()),
        orientation=cosines / (cells + doubt) if known else p.unknown_orientation,
        overlap=min(1.0, cells * a.region.step**2 / smaller) if smaller else 0.0,
    )


def similarity(evidence: Evidence, parameters: ScoreParameters | None = None) -> float:
    """Weigh the evidence: what agrees over what should and does not.

    ``(1 + L)³·√(1 + C)·exp(1.5·O + V) / (2 + U)`` for local likeness L, ring agreement C,
    orientation agreement O, overlap V and unpaired minutiae U.

    Parameters
    ----------
    evidence : Evidence
        From `gather_evidence`.
    parameters : ScoreParameters, optional
        Exponents.

    Returns
    -------
    float
        Positive, greater for more alike; only its order has meaning before calibration.
    """
    p = parameters or ScoreParameters()
    for_ = (1.0 + evidence.local) ** p.local_power
    for_ *= (1.0 + max(evidence.circle, 0.0)) ** p.circle_power
    for_ *= math.exp(
        p.orientation_weight * evidence.orientation + p.overlap_weight * evidence.overlap
    )
    against = (p.unpaired_offset + evidence.unpaired) ** p.unpaired_power
    return float(for_ / against)


def _moved_back(
    points: NDArray[np.float64], transform: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x and y of `points` under the inverse of `transform`."""
    c, s, tx, ty = transform
    scale = c * c + s * s
    x, y = points[0] - tx, points[1] - ty
    return (c * x + s * y) / scale, (c * y - s * x) / scale


def _field_agreement(
    a: PreparedTemplate, b: PreparedTemplate, alignment: Alignment
) -> tuple[float, float]:
    """Return the number of common cells and the sum of their orientations' agreement."""
    sums = np.empty(2)
    kernel.field_agreement(
        alignment.transform,
        a.region.cells,
        b.region.step,
        b.region.flow,
        b.region.mask,
        sums,
    )
    return float(sums[0]), float(sums[1])
