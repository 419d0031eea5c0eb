"""Score: the evidence for and against one finger, and the similarity it amounts to.

The similarity is a likelihood ratio, learned by logistic regression on synthetic prints by
``scripts/train_score``. With L the local likeness of m pairs and U the unpaired minutiae its
features are

- ``log(1 + L)``: how much is alike;
- ``log((1 + L) / (1 + m))``: how alike a pair is;
- ``√(U / (m + 2))``: what ought to be there in both and is in one alone;
- the overlap: how much of the smaller print is to be compared;
- the correlation of the ridges, and the logarithm of the area where they could be compared.

Prints whose codes have too little in common are not laid on one another at all: their sum lies
below the gate, the lower the less there is. Of the others, each feature is standardised,
so that 0 lies midway between genuine and impostor prints, then weighed. Where the minutiae leave no
doubt at first sight, or a print does not show its ridges, the ridges count as those of strangers
do. The sum is a logarithm of a ratio, and ``log(1 + e^sum)``, which is positive, the similarity.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.matching import _evidence_kernel as kernel
from fpmatch.matching.ridges import RidgeParameters

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
    "overlap",
    "ridges",
    "area of the ridges",
)
"""The names of the features, in the order in which the kernel has them."""

STANDARD: Final = ("middle", "spread", "weight", "stranger")
"""What is known of each feature, in the order of the rows of `ScoreWeights.standard`."""


NO_GLANCE: Final = (-1.0, 0.0, -1.0)
"""What the codes of any two prints say."""


@dataclass(frozen=True, slots=True, eq=False)
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
    overlap : float
        Share of the smaller print that lies in the common region.
    ridges : float
        Mean correlation of the ridges of both prints, -1 to 1; see
        `fpmatch.matching.ridges.ridge_correlation`.
    cells : int
        Cells whose ridges were compared; 0 where they were not looked at.
    features : ndarray of float64, shape (6,)
        The features of `FEATURES`, before they are standardised.
    total : float
        Their weighted sum.
    """

    pairs: int
    local: float
    unpaired: float
    common: int
    overlap: float
    ridges: float
    cells: int
    features: NDArray[np.float64] = field(repr=False)
    total: float

    @property
    def agreement(self) -> float:
        """Share of the minutiae inside the common region that are paired."""
        return 2 * self.pairs / self.common if self.common else 0.0

    @property
    def similarity(self) -> float:
        """``log(1 + e^total)``: greater for more alike; for sums above a few, the sum itself."""
        return float(kernel.as_similarity(self.total))


@dataclass(frozen=True, slots=True)
class ScoreParameters:
    """Set how evidence is gathered and turned into features.

    Parameters
    ----------
    margin_px : float
        How far from the border of the other print an unpaired minutia must lie to count, in pixels
        at 500 dpi: nearer, it is easily missed.
    doubt_pairs, doubt_cells : float
        Added to pairs and to cells: little evidence is not to count as much.
    """

    margin_px: float = 20.0
    doubt_pairs: float = 2.0
    doubt_cells: float = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class ScoreWeights:
    """Hold what was learned.

    Parameters
    ----------
    standard : ndarray of float64, shape (4, 6)
        Of each of `FEATURES`, the middle between genuine and impostor prints, the spread, the
        weight, and the mean of impostor prints.
    bias : float
        What is added to the sum.
    glance : tuple of float
        What the codes of two prints must say at least, see `fpmatch.matching.codes`, for them to be
        laid on one another: so much, and so much more a minutia of the smaller print, but no more
        than the third number.
    gate : float
        Sum under a rigid alignment above which prints are refined, and their ridges looked at;
        up to there the ridges count as those of strangers.
    sure : float
        Such a sum above which only the alignment that has it is refined.
    provenance : mapping
        From what they were learned.
    """

    standard: NDArray[np.float64]
    bias: float
    glance: tuple[float, float, float]
    gate: float
    sure: float
    provenance: Mapping[str, Any]

    def as_json(self) -> str:
        """Return the weights as the text of a JSON file."""
        rows = ",\n".join(
            "    " + json.dumps({"name": name, **dict(zip(STANDARD, column, strict=True))})
            for name, column in zip(FEATURES, self.standard.T.tolist(), strict=True)
        )
        entries = {
            "provenance": self.provenance,
            "bias": self.bias,
            "glance": self.glance,
            "gate": self.gate,
            "sure": self.sure,
        }
        return f'{json.dumps(entries, indent=2)[:-2]},\n  "features": [\n{rows}\n  ]\n}}\n'

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
            standard = np.array([[float(row[key]) for row in rows] for key in STANDARD])
            base, growth, most = map(float, document["glance"])
            bias, gate, sure = (float(document[name]) for name in ("bias", "gate", "sure"))
            return cls(standard, bias, (base, growth, most), gate, sure, document["provenance"])
        except (LookupError, TypeError, ValueError) as error:
            raise MatcherError("weights of the score: not such a file") from error


@cache
def load_weights() -> ScoreWeights:
    """Return the weights in the package."""
    return ScoreWeights.from_json(WEIGHTS_FILE.read_text(encoding="utf-8"))


def scales(
    room: int,
    weights: ScoreWeights | None = None,
    parameters: ScoreParameters | None = None,
    ridges: RidgeParameters | None = None,
) -> kernel.Scales:
    """Return what weighs alignments on a print of up to `room` minutiae, for one thread."""
    return kernel.Scales(
        parameters or ScoreParameters(),
        ridges or RidgeParameters(),
        weights or load_weights(),
        room,
    )


def gather_evidence(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    likeness: NDArray[np.float32],
    on: kernel.Scales | None = None,
) -> Evidence:
    """Gather and weigh the evidence for and against one finger in an alignment of two prints.

    Parameters
    ----------
    a, b : PreparedTemplate
        The two prints.
    alignment : Alignment
        How A lies on B.
    likeness : ndarray of float32, shape (N, M)
        Local likeness of their minutiae.
    on : Scales, optional
        What weighs (default: `scales` with the weights in the package).

    Returns
    -------
    Evidence
        Pairs, agreement of the ridges, what speaks against, and what it amounts to.
    """
    used = scales(len(b)) if on is None else on
    total = used.weigh(
        a.for_kernels(),
        b.for_kernels(),
        alignment.partner,
        alignment.bent,
        *alignment.transform.tolist(),
        likeness,
    )
    return evidence_on(used, total)


def evidence_on(used: kernel.Scales, total: float) -> Evidence:
    """Return what was weighed last, and came to `total`."""
    evidence, features = used.said()
    pairs, local, unpaired, common, overlap, correlation, cells = evidence
    return Evidence(
        pairs=int(pairs),
        local=local,
        unpaired=unpaired,
        common=int(common),
        overlap=overlap,
        ridges=correlation,
        cells=int(cells),
        features=np.array(features),
        total=float(total),
    )
