"""Score: the evidence for and against one finger, and the similarity it amounts to.

The similarity is a likelihood ratio, learned by logistic regression on synthetic prints by
``scripts/train_score``. With L the local likeness of m pairs, U the unpaired minutiae, and a few
constants (`ScoreParameters`) that keep little evidence from counting as much, its features are

- ``log(1 + L)``: how much is alike;
- ``log((1 + L) / (1 + m))``: how alike a pair is;
- ``√(U / (m + 2))``: what ought to be there in both and is in one alone;
- ``log(area + 5000 px²)`` and the overlap: how much there is to be compared;
- the agreement of the ridge orientations, of their changes from cell to cell, and the logarithm of
  how rough their difference is.

Each is standardised, so that 0 lies midway between genuine and impostor prints, then weighed. Where
an orientation is not known, its features are such zeros. The sum is a logarithm of a ratio, and
``log(1 + e^sum)``, which is positive, the similarity.
"""

from __future__ import annotations

import json
from dataclasses import astuple, dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.matching import _evidence_kernel as kernel

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.matching.align import Alignment
    from fpmatch.matching.prepare import PreparedTemplate

WEIGHTS_FILE: Final = Path(__file__).with_name("score_data") / "unit-circle.json"

FEATURES: Final = (
    "likeness",
    "likeness of a pair",
    "unpaired",
    "area",
    "overlap",
    "orientation",
    "change of orientation",
    "roughness",
)
"""The names of the features, in the order in which the kernel has them."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """Hold what an alignment says of two prints.

    Parameters
    ----------
    pairs : int
        Minutiae paired.
    local : float
        Sum of the local likeness of the pairs.
    unpaired : float
        Unpaired minutiae of both prints well inside the common region, each counted by the square
        of its quality.
    common : int
        Minutiae of both prints inside the common region, paired or not.
    area : float
        Area of the common region in px² at 500 dpi.
    overlap : float
        Share of the smaller print that lies in the common region.
    orientation : float
        Mean cosine of twice the difference between the ridge orientations over the common region,
        -1 to 1.
    change : float
        Correlation of the changes of the two orientations between neighbouring cells, -1 to 1.
    roughness : float
        How much the difference of the orientations changes between neighbouring cells: 0 for not
        at all, about 1 for at random.
    flow : bool
        Whether the orientations of both prints are known; else the last three mean nothing.
    """

    pairs: int
    local: float
    unpaired: float
    common: int
    area: float
    overlap: float
    orientation: float
    change: float
    roughness: float
    flow: bool

    @property
    def agreement(self) -> float:
        """Share of the minutiae inside the common region that are paired."""
        return 2 * self.pairs / self.common if self.common else 0.0


@dataclass(frozen=True, slots=True)
class ScoreParameters:
    """Set how evidence is gathered and turned into features.

    Parameters
    ----------
    margin_px : float
        How far from the border of the other print an unpaired minutia must lie to count, in pixels
        at 500 dpi: nearer, it is easily missed.
    doubt_pairs, doubt_area_px2, doubt_cells, doubt_change, least_roughness : float
        Added to pairs, area, numbers of cells, sum of changes and roughness: little evidence is
        not to count as much.
    """

    margin_px: float = 20.0
    doubt_pairs: float = 2.0
    doubt_area_px2: float = 5000.0
    doubt_cells: float = 10.0
    doubt_change: float = 0.5
    least_roughness: float = 0.002


@dataclass(frozen=True, slots=True, eq=False)
class ScoreWeights:
    """Hold what was learned.

    Parameters
    ----------
    standard : ndarray of float64, shape (3, 8)
        Of each of `FEATURES`, the middle between genuine and impostor prints, the spread, and the
        weight.
    bias : float
        What is added to the sum.
    provenance : mapping
        From what they were learned.
    """

    standard: NDArray[np.float64]
    bias: float
    provenance: Mapping[str, Any]

    def as_json(self) -> str:
        """Return the weights as the text of a JSON file."""
        rows = ",\n".join(
            "    "
            + json.dumps({"name": name, "middle": middle, "spread": spread, "weight": weight})
            for name, (middle, spread, weight) in zip(
                FEATURES, self.standard.T.tolist(), strict=True
            )
        )
        head = json.dumps({"provenance": self.provenance, "bias": self.bias}, indent=2)[:-2]
        return f'{head},\n  "features": [\n{rows}\n  ]\n}}\n'

    @classmethod
    def from_json(cls, text: str) -> ScoreWeights:
        """Read what `as_json` wrote.

        Raises
        ------
        MatcherError
            If the text is no such thing, or its features are others than `FEATURES`.
        """
        try:
            document = json.loads(text)
            rows = document["features"]
            if tuple(row["name"] for row in rows) != FEATURES:
                raise MatcherError("weights of the score: of other features than this version has")
            columns = [[float(row[key]) for row in rows] for key in ("middle", "spread", "weight")]
            return cls(np.array(columns), float(document["bias"]), document["provenance"])
        except (LookupError, TypeError, ValueError) as error:
            raise MatcherError("weights of the score: not such a file") from error


@cache
def load_weights() -> ScoreWeights:
    """Return the weights in the package."""
    return ScoreWeights.from_json(WEIGHTS_FILE.read_text(encoding="utf-8"))


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
        What counts.

    Returns
    -------
    Evidence
        Pairs, agreement of the ridge orientations, and what speaks against.
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
        p.margin_px,
        p.doubt_cells,
        p.doubt_change,
        np.empty(max(len(b), a.region.code.shape[1]), np.int32),
        found,
    )
    return Evidence(
        pairs=int(found[0]),
        local=float(found[1]),
        unpaired=float(found[2]),
        common=int(found[3]),
        area=float(found[4]),
        overlap=float(found[5]),
        orientation=float(found[6]),
        change=float(found[7]),
        roughness=float(found[8]),
        flow=bool(found[9]),
    )


def features(evidence: Evidence, parameters: ScoreParameters | None = None) -> NDArray[np.float64]:
    """Return the features of `FEATURES` that the evidence has, as they are before standardising.

    Parameters
    ----------
    evidence : Evidence
        From `gather_evidence`.
    parameters : ScoreParameters, optional
        Constants.

    Returns
    -------
    ndarray of float64, shape (8,)
        The features; those of orientations that are not known mean nothing.
    """
    p = parameters or ScoreParameters()
    found = np.empty(len(FEATURES))
    kernel.describe(_as_array(evidence), p.doubt_pairs, p.doubt_area_px2, p.least_roughness, found)
    return found


def similarity(
    evidence: Evidence,
    parameters: ScoreParameters | None = None,
    weights: ScoreWeights | None = None,
) -> float:
    """Weigh the evidence: the standardised features' weighted sum, as a positive number.

    Parameters
    ----------
    evidence : Evidence
        From `gather_evidence`.
    parameters : ScoreParameters, optional
        Constants of the features.
    weights : ScoreWeights, optional
        Weights (default: those in the package).

    Returns
    -------
    float
        ``log(1 + e^sum)``, greater for more alike; for sums above a few, the sum itself.
    """
    p, w = parameters or ScoreParameters(), weights or load_weights()
    return float(
        kernel.weigh(
            _as_array(evidence),
            p.doubt_pairs,
            p.doubt_area_px2,
            p.least_roughness,
            w.standard,
            w.bias,
            np.empty(len(FEATURES)),
        )
    )


def _as_array(evidence: Evidence) -> NDArray[np.float64]:
    return np.array(astuple(evidence), np.float64)
