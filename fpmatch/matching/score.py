"""Score: the evidence for and against one finger, and the similarity it amounts to."""

from __future__ import annotations

from dataclasses import astuple, dataclass
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

    @property
    def of_weighing(self) -> NDArray[np.float64]:
        """The parameters of `similarity`, in the order in which the kernel takes them."""
        return np.array(
            [
                self.local_power,
                self.circle_power,
                self.unpaired_power,
                self.unpaired_offset,
                self.orientation_weight,
                self.overlap_weight,
            ]
        )


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
    found = np.empty(kernel.ENTRIES)
    kernel.gather(
        a.for_kernels(),
        b.for_kernels(),
        alignment.partner,
        alignment.bent,
        *alignment.transform.tolist(),
        likeness,
        p.orientation_doubt_cells,
        p.unknown_orientation,
        np.empty(len(b), np.int32),
        found,
    )
    pairs, local, circle, unpaired, common, orientation, overlap = found.tolist()
    return Evidence(int(pairs), local, circle, unpaired, int(common), orientation, overlap)


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
    return float(kernel.weigh(np.array(astuple(evidence), np.float64), p.of_weighing))
