"""Score: the evidence for and against one finger, and the similarity it amounts to.

The similarity is a likelihood ratio, learned by logistic regression on synthetic prints by
``python -m research train score``. With m pairs, of local similarity L in all, and U the unpaired
minutiae, its features are

- of the relaxed local matches: the logarithm of the sum over the pairs;
- of the mesh of pairs (see `fpmatch.matching.pair_mesh`), per pair: how well the places on the unit
  circle agree (eq. 3), how well the shape-preserving weights predict the partner (eq. 4), how full
  the rings are of pairs, and how many triangles are turned over; the strain of its edges;
- of the neighbourhoods: ``log(1 + L)``;
- ``√(U / (m + 2))``: minutiae that should be paired and are not, each by the square of its quality,
  raised where the mean of these squares in a print is below 0.25: all of them cannot be nothing;
- the overlap: the share of the smaller print that is compared;
- ``m / (n + 5)``, of n minutiae of the smaller print: what the paper decides by;
- the correlation of the ridges, the logarithm of the area where they could be compared, and by how
  many standard errors, nearly, the correlation is above that of different fingers.

There are three sets of weights: one for two prints that have pictures of their ridges, one for
minutiae alone, in which those of the ridges are 0, and one for two prints with ridges of which the
smaller has an area of at most 77 mm2. Where one of the prints has ridges the second serves, with
quantiles (see below) of its own: the area of such a print is that of its mask, not of the convex
hull of its minutiae. Each feature is standardised, so that 0 lies midway between genuine
and impostor prints, then weighted. Where the ridges were not compared, because the minutiae leave
no doubt in coarse alignment, their features are the mean of impostor prints.

How rarely two fingers reach a sum by chance depends on how much was compared: two minutiae agree
easily, twenty do not. So the sum is conditioned on the amount of evidence. Let n be the minutiae in
the common region, per print, averaged geometrically with those of the smaller print, and a the area
of the common region. Beyond about 12 minutiae and 30,000 square pixels at 500 dpi (77 mm2) they
count no further: the features say what more there is to say of whole prints. The sums that 1 % and
0.1 % of impostor comparisons reach are linear in the terms of `AMOUNTS`; between and beyond them
the tail of the impostor comparisons is exponential.

Impostor prints are drawn by chance; a template may be made to match. Of the arrangements of a few
minutiae the commonest, which a search finds, matches far more prints than one drawn by chance. So
the FMR falls at most tenfold for every 12 cells of ridges compared, and by 10^1.2 for every pair
after the first: a place within 12 pixels and 30 degrees of a minutia has another, of the 40 of a
usual print, about once in 20 times. Ridges count so where their correlation is 0.4 or more, and
less down to 0.2, that of different fingers. Of very many minutiae a good many fall on others
wherever they lie: where chance is expected to give more than 3 pairs, the FMR is at least what a
Poisson distribution says of so many. Genuine whole prints do not come near these bounds.

What comes out is an estimate of -ln(FMR), the same for prints with ridges and without, and
``log(1 + e^that)``, which is positive, is the similarity. Prints that the prefilter rejects get an
estimate of -5, and less the more they fall short.
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
from fpmatch.matching.align import aligner_of
from fpmatch.matching.ridge_search import RidgeSearchParameters

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fpmatch.matching.align import Alignment
    from fpmatch.matching.prepare import PreparedTemplate

WEIGHTS_FILE: Final = Path(__file__).with_name("score_data") / "unit-circle.json"

FEATURES: Final = (
    "relaxed similarity",
    "places on the circle",
    "weights in the ring",
    "fullness of the rings",
    "triangles turned over",
    "strain",
    "local similarity",
    "unpaired",
    "overlap",
    "share of the minutiae",
    "ridges",
    "area of the ridges",
    "ridges by area",
)
"""The names of the features, in the order in which the kernel has them."""

RIDGE_FEATURES: Final = FEATURES[-3:]
"""Those that minutiae alone do not have."""

SMALL_FEATURES: Final = ("ridges by area",)
"""Those that count where the smaller print is small: elsewhere the area differs too little."""

STANDARD: Final = ("middle", "spread", "weight", "impostor_mean")
"""What is known of each feature, in the order of the rows of `ScoreModel.standard`."""

LIMITS: Final = (
    "prefilter_base",
    "prefilter_growth",
    "prefilter_limit",
    "relaxation_threshold",
    "refine_threshold",
    "confident_threshold",
    "bias",
)
"""The numbers of a model beside its features, in the order in which the kernel has them."""

AMOUNTS: Final = (
    "1",
    "1 / (n + 1)",
    "1 / (n + 1)^2",
    "log(a / 10000 px^2)",
    "log(a / 10000 px^2) / (n + 1)",
)
"""The terms of the amount of evidence, in the order in which the kernel has them."""

RATES: Final = (0.01, 0.001)
"""The shares of the impostor comparisons whose least sums a model has."""

NO_QUANTILES: Final = ((0.0,) * len(AMOUNTS), (1.0, *(0.0,) * (len(AMOUNTS) - 1)))
"""Quantiles that do not depend on the amount of evidence."""

MODELS: Final = ("with ridges", "minutiae alone", "one with ridges", "small with ridges")
"""The models, in the order in which the kernel has them."""

WITH_RIDGES, MINUTIAE_ALONE, ONE_WITH_RIDGES, SMALL_WITH_RIDGES = MODELS
SMALL_AREA_PX2: Final = 30_000.0
"""Area in square pixels at 500 dpi up to which the smaller of two prints is small: 77 mm2."""

MODELS_BY_SHOWN: Final = (MINUTIAE_ALONE, ONE_WITH_RIDGES, WITH_RIDGES)
"""The models by how many of the two prints have pictures of their ridges."""

NO_PREFILTER: Final = (-1.0, 0.0, -1.0)
"""A prefilter threshold that all prints pass."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Hold the evidence in an alignment of two prints.

    Parameters
    ----------
    pairs : int
        Minutiae paired.
    local : float
        Sum of the local similarity of the pairs.
    unpaired : float
        Unpaired minutiae of both prints well inside the common region, each counted by the square
        of its quality.
    common : int
        Minutiae of both prints inside the common region, paired or not.
    overlap : float
        Share of the smaller print that lies in the common region.
    relaxed : float
        Sum of the relaxed similarity of the pairs.
    places, weights : float
        Sums over the pairs, each 0 to 1: agreement of the places on the unit circle, and agreement
        with the prediction by the shape-preserving weights.
    fullness : float
        Sum over the pairs of the share of their ring, by weight, that is made of pairs.
    turned : int
        Triangles at pairs, in the mesh of pairs, that are turned over in the other print.
    strain : float
        Mean relative change of length of the edges of the mesh of pairs.
    fewest : int
        Minutiae of the smaller print.
    ridges : float
        Mean correlation of the ridges of both prints, -1 to 1; see
        `fpmatch.matching.ridges.ridge_correlation`.
    cells : int
        Cells whose ridges were compared; 0 where they were not.
    area : float
        Area of the common region, in square pixels at 500 dpi.
    chance : float
        Pairs expected where the minutiae inside the common region lie there by chance.
    features : ndarray of float64, shape (13,)
        The features of `FEATURES`, before they are standardised.
    total : float
        Their weighted sum.
    decade : float
        By how much the sum rises where the FMR falls tenfold.
    minus_log_fmr : float
        The sum, conditioned on how much was compared: an estimate of -ln(FMR).
    """

    pairs: int
    local: float
    unpaired: float
    common: int
    overlap: float
    relaxed: float
    places: float
    weights: float
    fullness: float
    turned: int
    strain: float
    fewest: int
    ridges: float
    cells: int
    area: float
    chance: float
    features: NDArray[np.float64] = field(repr=False)
    total: float
    decade: float
    minus_log_fmr: float

    @property
    def agreement(self) -> float:
        """Share of the minutiae inside the common region that are paired."""
        return 2 * self.pairs / self.common if self.common else 0.0

    @property
    def similarity(self) -> float:
        """``log(1 + e^x)`` of `minus_log_fmr`: where that is more than a few, as good as that."""
        return float(kernel.as_similarity(self.minus_log_fmr))


@dataclass(frozen=True, slots=True)
class ScoreParameters:
    """Set how evidence is gathered and turned into features.

    Parameters
    ----------
    margin_px : float
        How far from the border of the other print an unpaired minutia must lie to count, in pixels
        at 500 dpi: nearer, it is easily missed.
    hull_margin_px : float
        The same where the convex hull of the minutiae stands for the print: the print reaches
        farther than its outermost minutiae.
    doubt_pairs, doubt_minutiae, doubt_cells : float
        Added to pairs, minutiae and cells: little evidence is not to count as much.
    usual_correlation : float
        Correlation of the ridges of different fingers.
    """

    margin_px: float = 20.0
    hull_margin_px: float = 0.0
    doubt_pairs: float = 2.0
    doubt_minutiae: float = 5.0
    doubt_cells: float = 10.0
    usual_correlation: float = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class ScoreModel:
    """Hold what was learned for one kind of prints.

    Parameters
    ----------
    standard : ndarray of float64, shape (4, 13)
        Of each of `FEATURES`, the middle between genuine and impostor prints, the spread, the
        weight, and the mean of impostor prints.
    bias : float
        What is added to the sum.
    prefilter : tuple of float
        The least score of the bit descriptors of two prints from which they are aligned, see
        `fpmatch.matching.bit_descriptors`: a base, its growth with the minutiae of the smaller
        print, and its limit.
    relaxation_threshold : float
        Strength of the relaxed local matches from which more than one hypothesis is tried.
    refine_threshold : float
        Sum in coarse alignment above which prints are refined, and their ridges compared.
    confident_threshold : float
        Such a sum above which the hypothesis that has it is refined alone.
    quantiles : ndarray of float64, shape (2, 5)
        For each of `RATES`, the coefficients of the terms of `AMOUNTS`, which make the sum that so
        many impostor comparisons reach.
    genuine_median : ndarray of float64, shape (5,)
        The coefficients that make the -ln(FMR) that half of the genuine comparisons reach, where n
        and a are the minutiae and the area of the smaller print.
    """

    standard: NDArray[np.float64]
    bias: float
    prefilter: tuple[float, float, float]
    relaxation_threshold: float
    refine_threshold: float
    confident_threshold: float
    quantiles: NDArray[np.float64]
    genuine_median: NDArray[np.float64] = field(default_factory=lambda: np.zeros(len(AMOUNTS)))

    @property
    def limits(self) -> NDArray[np.float64]:
        """The numbers of `LIMITS`."""
        return np.array(
            [
                *self.prefilter,
                self.relaxation_threshold,
                self.refine_threshold,
                self.confident_threshold,
                self.bias,
            ]
        )

    def as_document(self) -> dict[str, Any]:
        """Return the model as what JSON can hold."""
        columns = zip(FEATURES, self.standard.T.tolist(), strict=True)
        amounts = (dict(zip(AMOUNTS, row, strict=True)) for row in self.quantiles.tolist())
        return {
            **dict(zip(LIMITS, self.limits.tolist(), strict=True)),
            "impostor_quantiles": dict(zip(map(str, RATES), amounts, strict=True)),
            "genuine_median": dict(zip(AMOUNTS, self.genuine_median.tolist(), strict=True)),
            "features": [
                {"name": name, **dict(zip(STANDARD, column, strict=True))}
                for name, column in columns
            ],
        }

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> ScoreModel:
        """Return the model that `as_document` wrote; of other features, raise MatcherError."""
        rows = document["features"]
        if tuple(row["name"] for row in rows) != FEATURES:
            raise MatcherError("weights of the score: of other features than this version has")
        standard = np.array([[float(row[key]) for row in rows] for key in STANDARD])
        *prefilter, relaxation, refine, confident, bias = (float(document[k]) for k in LIMITS)
        base, growth, limit = prefilter
        rows = [document["impostor_quantiles"][str(rate)] for rate in RATES]
        quantiles = np.array([[float(row[name]) for name in AMOUNTS] for row in rows])
        median = np.array([float(document["genuine_median"][name]) for name in AMOUNTS])
        limits = (base, growth, limit), relaxation, refine, confident
        return cls(standard, bias, *limits, quantiles, median)

    def sums(self, features: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the weighted sums of features, shape (..., 13), as the kernel makes them."""
        middle, spread, weight, _ = self.standard
        return np.asarray(self.bias + (features - middle) / spread @ weight)

    def ridge_sum(self, features: NDArray[np.float64]) -> float:
        """Return what the ridges add to the sum of features, shape (13,)."""
        _, spread, weight, impostor_mean = self.standard
        added = (features - impostor_mean) / spread * weight
        return float(sum(added[FEATURES.index(name)] for name in RIDGE_FEATURES))

    def typical(self, minutiae: float, area: float) -> float:
        """Return the -ln(FMR) that half of the genuine comparisons of so much reach.

        Parameters
        ----------
        minutiae : float
            Minutiae of the smaller print.
        area : float
            Area of the smaller print, in square pixels at 500 dpi.

        Returns
        -------
        float
            The median.
        """
        return float(self.genuine_median @ amount_terms(minutiae, area))


def amount_terms(minutiae: float, area: float) -> NDArray[np.float64]:
    """Return the terms of `AMOUNTS`, of minutiae and of area in square pixels at 500 dpi."""
    terms = np.empty(len(AMOUNTS))
    kernel.describe_amount(minutiae, area, terms)
    return terms


@dataclass(frozen=True, slots=True, eq=False)
class ScoreWeights:
    """Hold what was learned.

    Parameters
    ----------
    models : tuple of ScoreModel
        The models of `MODELS`.
    provenance : mapping
        From what they were learned.
    small_area : float
        Area in square pixels at 500 dpi up to which the smaller of two prints is small.
    """

    models: tuple[ScoreModel, ...]
    provenance: Mapping[str, Any]
    small_area: float = SMALL_AREA_PX2

    def model_of(self, a: PreparedTemplate, b: PreparedTemplate) -> ScoreModel:
        """Return the model by which two prints are scored."""
        shown = (a.region.ridges is not None) + (b.region.ridges is not None)
        name = MODELS_BY_SHOWN[shown]
        if name == WITH_RIDGES and min(a.region.area, b.region.area) <= self.small_area:
            name = SMALL_WITH_RIDGES
        return self.models[MODELS.index(name)]

    @property
    def standard(self) -> NDArray[np.float64]:
        """Those of all models, shape (4, 4, 13)."""
        return np.stack([model.standard for model in self.models])

    @property
    def limits(self) -> NDArray[np.float64]:
        """Those of all models, shape (4, 7)."""
        return np.stack([model.limits for model in self.models])

    @property
    def quantiles(self) -> NDArray[np.float64]:
        """Those of all models, shape (4, 2, 5)."""
        return np.stack([model.quantiles for model in self.models])

    def as_json(self) -> str:
        """Return the weights as the text of a JSON file."""
        documents = zip(MODELS, (model.as_document() for model in self.models), strict=True)
        entries = {
            "provenance": self.provenance,
            "small_area": self.small_area,
            "models": dict(documents),
        }
        return f"{json.dumps(entries, indent=1)}\n"

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
            models = (ScoreModel.from_document(document["models"][name]) for name in MODELS)
            return cls(tuple(models), document["provenance"], float(document["small_area"]))
        except (LookupError, TypeError, ValueError) as error:
            raise MatcherError("weights of the score: not such a file") from error


@cache
def load_weights() -> ScoreWeights:
    """Return the weights in the package."""
    return ScoreWeights.from_json(WEIGHTS_FILE.read_text(encoding="utf-8"))


def evidence_scorer(
    room: int,
    weights: ScoreWeights | None = None,
    parameters: ScoreParameters | None = None,
    search: RidgeSearchParameters | None = None,
) -> kernel.EvidenceScorer:
    """Return what scores alignments with a print of up to `room` minutiae, for one thread."""
    return kernel.EvidenceScorer(
        parameters or ScoreParameters(),
        weights or load_weights(),
        room,
        search or RidgeSearchParameters(),
    )


def gather_evidence(
    a: PreparedTemplate,
    b: PreparedTemplate,
    alignment: Alignment,
    similarity: NDArray[np.float32],
    scorer: kernel.EvidenceScorer | None = None,
) -> Evidence:
    """Gather and weigh the evidence for and against one finger in an alignment of two prints.

    Parameters
    ----------
    a, b : PreparedTemplate
        The two prints.
    alignment : Alignment
        Their pairs and transform.
    similarity : ndarray of float32, shape (N, M)
        Local similarity of their minutiae.
    scorer : EvidenceScorer, optional
        What scores (default: `evidence_scorer` with the weights in the package).

    Returns
    -------
    Evidence
        Of pairs, mesh, unpaired minutiae and ridges, and what it comes to.
    """
    used = evidence_scorer(len(b)) if scorer is None else scorer
    aligner = aligner_of(a.points, b.points)
    aligner.relax(similarity)
    aligner.impose(alignment.partner, *alignment.transform.tolist())
    found = used.score_alignment(a.for_kernels(), b.for_kernels(), aligner, similarity)
    return evidence_of(used, found)


def evidence_of(scorer: kernel.EvidenceScorer, minus_log_fmr: float) -> Evidence:
    """Return the evidence that was scored last, and came to `minus_log_fmr`."""
    entries, features = scorer.last_evidence()
    pairs, local, unpaired, common, overlap, relaxed, places, weights = entries[:8]
    fullness, turned, strain, fewest, correlation, cells, area, chance = entries[8:]
    return Evidence(
        pairs=int(pairs),
        local=local,
        unpaired=unpaired,
        common=int(common),
        overlap=overlap,
        relaxed=relaxed,
        places=places,
        weights=weights,
        fullness=fullness,
        turned=int(turned),
        strain=strain,
        fewest=int(fewest),
        ridges=correlation,
        cells=int(cells),
        area=float(area),
        chance=float(chance),
        features=np.array(features),
        total=float(scorer.total),
        decade=float(scorer.decade),
        minus_log_fmr=float(minus_log_fmr),
    )
