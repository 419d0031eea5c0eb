"""Evidence: what a score is made of, its learned model, and the reasons against one finger.

The score is learned by logistic regression on synthetic prints by ``python -m research train
score``. docs/explanation/how_it_works.md describes its features, how their sum is conditioned on
the amount of evidence, and its bounds. The result is an estimate of -ln(FMR), on one scale for
prints with and without ridges. The similarity, ``log(1 + e^estimate)``, is positive. Prints that
the prefilter rejects get an estimate of -5 or less, by how far they fall short.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from fpmatch.matching import constants as fixed
from fpmatch.printable import count

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.matching.prints.prepared import PreparedTemplate

WEIGHTS_FILE: Final = Path(__file__).with_name("score_data") / "unit-circle.json"

FEATURES: Final = (
    "relaxed similarity",
    "places on the circle",
    "weights in the ring",
    "fullness of the rings",
    "local similarity",
    "unpaired",
    "overlap",
    "share of the minutiae",
    "ridges",
    "area of the ridges",
    "ridges by area",
)
"""The names of the features, in the order in which the kernel has them."""

RIDGE_FEATURES: Final = FEATURES[-3:]  # that minutiae alone do not have
STANDARD: Final = ("middle", "spread", "weight", "impostor_mean")  # rows of `ScoreModel.standard`
AMOUNTS: Final = (
    "1",
    "1 / (n + 1)",
    "1 / (n + 1)^2",
    "log(a / 10000 px^2)",
    "log(a / 10000 px^2) / (n + 1)",
)
"""The terms of the amount of evidence, in the order in which the kernel has them."""

RATES: Final = (0.01, 0.001)  # shares of the impostor comparisons whose least sums a model has

MODELS: Final = ("with ridges", "minutiae alone", "small with ridges")
"""The models, in the order in which the kernel has them."""

WITH_RIDGES, MINUTIAE_ALONE, SMALL_WITH_RIDGES = MODELS
FEW_MINUTIAE: Final = 12  # fewer are too few for the data of whole prints


@dataclass(frozen=True, slots=True, eq=False)
class ScoreModel:
    """The weights that were learned for one kind of prints.

    Prints are aligned if the score of their bit descriptors reaches a base plus a growth with the
    minutiae of the smaller print, up to a limit. The coefficients of the terms of `AMOUNTS` make
    the sums that so many impostor comparisons reach, and the -ln(FMR) that half of the genuine
    comparisons reach, where the amount is that of the smaller print.
    """

    standard: NDArray[np.float64]  # (4, 11): a row for each of `STANDARD`
    bias: float  # added to the sum
    prefilter: tuple[float, ...] | NDArray[np.float64]  # base, growth, limit
    relaxation_threshold: float  # of the local matches' strength: above, more hypotheses are tried
    refine_threshold: float  # of the sum: above, prints are refined, and their ridges compared
    confident_threshold: float  # of the sum: above, a hypothesis is refined alone
    quantiles: NDArray[np.float64]  # (2, 5), for each of `RATES`
    genuine_median: NDArray[np.float64] = field(default_factory=lambda: np.zeros(len(AMOUNTS)))

    @property
    def limits(self) -> NDArray[np.float64]:
        """Prefilter, thresholds and bias, in the order in which the kernel has them."""
        sums = self.relaxation_threshold, self.refine_threshold, self.confident_threshold
        return np.array([*self.prefilter, *sums, self.bias])

    def sums(self, features: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the weighted sums of features, shape (..., 11), as the kernel makes them."""
        middle, spread, weight, _ = self.standard
        return np.asarray(self.bias + (features - middle) / spread @ weight)


def amount_terms(minutiae: float, area: float) -> NDArray[np.float64]:
    """Return the terms of `AMOUNTS`, of minutiae and of area in square pixels at 500 dpi."""
    amount = np.array([minutiae, area])
    share = (amount / (fixed.ENOUGH_MINUTIAE, fixed.ENOUGH_AREA)) ** 2
    # about the amount where it is much less than what is enough, else about that
    n, a = (amount / np.sqrt(np.sqrt(1.0 + share * share))).tolist()
    x, y = 1.0 / (n + 1.0), math.log(max(a, fixed.LEAST_AREA) / fixed.UNIT_AREA)
    return np.array([1.0, x, x * x, y, x * y])


@dataclass(frozen=True, slots=True, eq=False)
class ScoreWeights:
    """The models of `MODELS`, and from what they were learned."""

    models: tuple[ScoreModel, ...]
    provenance: Mapping[str, Any]

    def model_of(self, a: PreparedTemplate, b: PreparedTemplate) -> ScoreModel:
        """Return the model by which two prints are scored."""
        if a.region.ridges is None or b.region.ridges is None:
            return self.models[MODELS.index(MINUTIAE_ALONE)]
        small = min(a.region.area, b.region.area) <= fixed.SMALL_AREA_PX2
        return self.models[MODELS.index(SMALL_WITH_RIDGES if small else WITH_RIDGES)]

    def is_small(self, a: PreparedTemplate, b: PreparedTemplate) -> bool:
        """Return whether two prints show their ridges, and the smaller one is small."""
        return self.model_of(a, b) is self.models[MODELS.index(SMALL_WITH_RIDGES)]

    def typical(
        self, probe: NDArray[np.float64], references: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the -ln(FMR) that half of the genuine comparisons of prints reach.

        `probe` and `references`, shape (..., 5), are what the matcher's `amount` returns. Few
        minutiae on much skin are beyond the data of the model for such prints: there, that of
        small prints bounds the result.
        """
        minutiae, area = np.moveaxis(np.minimum(probe[..., :2], references[..., :2]), -1, 0)
        both = np.minimum(probe[..., 2], references[..., 2]) > 0.0  # with ridges
        x = np.maximum(probe[..., 3], references[..., 3])
        y = np.minimum(probe[..., 4], references[..., 4])
        terms = np.stack([np.ones_like(x), x, x * x, y, x * y], axis=-1)
        by_model = {
            name: terms @ one.genuine_median for name, one in zip(MODELS, self.models, strict=True)
        }
        typical = np.where(both, by_model[WITH_RIDGES], by_model[MINUTIAE_ALONE])
        small = by_model[SMALL_WITH_RIDGES]
        typical = np.where(both & (minutiae < FEW_MINUTIAE), np.minimum(typical, small), typical)
        return np.asarray(np.where(both & (area <= fixed.SMALL_AREA_PX2), small, typical))

    @classmethod
    def from_json(cls, text: str) -> ScoreWeights:
        """Read what ``python -m research train score`` wrote."""
        document, models = json.loads(text), []
        for name in MODELS:
            entries: dict[str, Any] = document["models"][name]
            arrays = {key: np.array(entry) for key, entry in entries.items() if np.ndim(entry)}
            models.append(ScoreModel(**entries | arrays))
        return cls(tuple(models), document["provenance"])


class Evidence(NamedTuple):
    """The evidence in an alignment of two prints; areas are in square pixels at 500 dpi.

    The common region is where both prints lie.
    """

    pairs: float
    local: float  # sum of the local similarity of the pairs
    unpaired: float  # minutiae well inside the common region, each by the square of its quality
    common: float  # minutiae of both prints inside the common region, paired or not
    overlap: float  # share of the smaller print that lies in the common region
    relaxed: float  # sum of the relaxed similarity of the pairs
    places: float  # sum over the pairs, 0 to 1 each: agreement of places on the unit circle
    weights: float  # the same of the agreement with the prediction by the weights of the ring
    fullness: float  # sum over the pairs of the share of their ring, by weight, made of pairs
    fewest: float  # minutiae of the smaller print
    ridges: float  # mean correlation of the ridges, see `reference.ridges`
    cells: float  # cells whose ridges were compared; 0 where they were not
    area: float  # of the common region
    total: float  # weighted sum of the features
    minus_log_fmr: float  # estimate of -ln(FMR): the sum, conditioned on how much was compared

    @property
    def agreement(self) -> float:
        """Share of the minutiae inside the common region that are paired."""
        return 2 * self.pairs / self.common if self.common else 0.0

    @property
    def similarity(self) -> float:
        """``log(1 + e^x)`` of `minus_log_fmr`: where that is more than a few, as good as that."""
        return float(np.logaddexp(0.0, self.minus_log_fmr))


@cache
def load_weights() -> ScoreWeights:
    """Return the weights in the package."""
    return ScoreWeights.from_json(WEIGHTS_FILE.read_text(encoding="utf-8"))


def main_reason(evidence: Evidence) -> str:
    """Return the main reason against one finger, by the evidence of the score."""
    pairs, minutiae = int(evidence.pairs), int(evidence.common)
    among = f"{count(pairs, 'pair')} among the {count(minutiae, 'minutia', 'minutiae')}"
    where = f"of both prints in the common region ({evidence.overlap:.0%} of the smaller print)"
    return f"too little agrees under the best transform: {among} {where}"
