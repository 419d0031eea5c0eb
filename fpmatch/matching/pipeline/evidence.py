"""Score: the evidence for and against one finger, and the similarity it amounts to.

It is learned by logistic regression on synthetic prints by ``python -m research train score``. With
m pairs, of local similarity L in all, and U the unpaired minutiae, its features are

- of the relaxed local matches: the logarithm of the sum over the pairs;
- of the mesh of pairs (see `_pair_mesh_kernel`), over the number of pairs and one: how well the
  places on the unit circle agree (eq. 3), how well the shape-preserving weights predict the partner
  (eq. 4), and how full the rings are of pairs;
- of the neighbourhoods: ``log(1 + L)``;
- ``√(U / (m + 2))``: minutiae that should be paired and are not, each by the square of its quality,
  raised where the mean of these squares in a print is below 0.25;
- the overlap: the share of the smaller print that is compared;
- ``m / (n + 5)``, of n minutiae of the smaller print: the share that the paper decides by;
- the correlation of the ridges, the logarithm of the area where they could be compared, and by how
  many standard errors, nearly, the correlation is above that of different fingers.

There are three models: one for two prints that have ridge images; one for minutiae alone, in which
the weights of the ridges are 0, and by which a print with ridges and one without are compared, too;
and one for two prints with ridges where the smaller has an area of at most 77 mm². Each feature is
standardised, so that 0 lies midway between genuine and impostor prints, then weighted. Where the
ridges were not compared, because the minutiae decide in coarse alignment, their features are the
mean of impostor prints.

How rarely two fingers reach a sum by chance depends on how much was compared: two minutiae agree
easily, twenty do not. So the sum is conditioned on the amount of evidence. Let n be the geometric
mean of the minutiae in the common region, per print, and the minutiae of the smaller print, and let
a be the area of the common region. Beyond about 12 minutiae and 30,000 square pixels at 500 dpi
(77 mm²) they have no effect: the features describe whole prints. The sums that 1 % and 0.1 % of
impostor comparisons reach are linear in the terms of `score_model.AMOUNTS`;
between and beyond them the tail of the impostor comparisons is exponential.

Impostor prints agree by chance, but a template may be made to match. The commonest arrangement of a
few minutiae, which a search finds, matches far more prints than a random one. Therefore the FMR
falls at most tenfold for every 12 cells of ridges compared, and by 10^1.2 for every pair
after the first: a place within 12 pixels and 30 degrees of a minutia has another, of the 40 of a
usual print, about once in 20 times. Ridges count fully where their correlation is 0.4 or more, and
less down to 0.2, that of different fingers. In dense prints many minutiae are paired by chance:
where more than 3 such pairs are expected, the FMR is at least the probability of so many pairs in a
Poisson distribution. Genuine whole prints stay far from these bounds.

Minutiae in frequent places, in the directions that are usual there, pair in many prints. Therefore
an FMR below 1 % is held against the pairs expected by chance under the best transform: the minutiae
of B within 60 pixels of where a minutia of A is predicted, in about its direction, show how many.
A Poisson distribution with that mean gives the decades of the FMR for so many pairs; pairs that lie
nearer to their predictions than by chance, and ridges that correlate by over 0.315, add to them.
Of what the estimate exceeds these decades by, less 1, only 20 % counts; less up to 1.4 where
the smaller print has fewer than 28 minutiae, since few minutiae can be arranged to match more.
Nothing counts beyond 1 % where the minutiae of a print do not lie along its own ridges.

The result is an estimate of -ln(FMR), on one scale for prints with and without ridges. The
similarity is ``log(1 + e^estimate)``, which is positive. Prints that the prefilter rejects get an
estimate of -5 or less, by how far they fall short.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.matching.pipeline.score_model import ScoreWeights, as_similarity
from fpmatch.printable import count

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

WEIGHTS_FILE: Final = Path(__file__).with_name("score_data") / "unit-circle.json"


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """The evidence in an alignment of two prints; areas are in square pixels at 500 dpi.

    The common region is where both prints lie. The first fourteen entries are the kernel's.
    """

    pairs: int
    local: float  # sum of the local similarity of the pairs
    unpaired: float  # minutiae well inside the common region, each by the square of its quality
    common: int  # minutiae of both prints inside the common region, paired or not
    overlap: float  # share of the smaller print that lies in the common region
    relaxed: float  # sum of the relaxed similarity of the pairs
    places: float  # sum over the pairs, 0 to 1 each: agreement of places on the unit circle
    weights: float  # the same of the agreement with the prediction by the weights of the ring
    fullness: float  # sum over the pairs of the share of their ring, by weight, made of pairs
    fewest: int  # minutiae of the smaller print
    ridges: float  # mean correlation of the ridges, see `reference.ridges`
    cells: int  # cells whose ridges were compared; 0 where they were not
    area: float  # of the common region
    chance: float  # pairs expected where the minutiae in the common region lie there by chance
    features: NDArray[np.float64] = field(repr=False)  # by `FEATURES`, not yet standardised
    total: float  # weighted sum of the features
    minus_log_fmr: float  # estimate of -ln(FMR): the sum, conditioned on how much was compared

    @property
    def agreement(self) -> float:
        """Share of the minutiae inside the common region that are paired."""
        return 2 * self.pairs / self.common if self.common else 0.0

    @property
    def similarity(self) -> float:
        """``log(1 + e^x)`` of `minus_log_fmr`: where that is more than a few, as good as that."""
        return as_similarity(self.minus_log_fmr)


SMALL_OVERLAP: Final = 0.25  # share of the smaller print: the common region is small
POOR_RIDGES: Final = 0.3  # correlation: hardly more than that of impostor prints
MOSTLY_PAIRED: Final = 0.5  # share of the minutiae in the common region: not too few are paired


@cache
def load_weights() -> ScoreWeights:
    """Return the weights in the package."""
    return ScoreWeights.from_json(WEIGHTS_FILE.read_text(encoding="utf-8"))


def main_reason(evidence: Evidence) -> str:
    """Return the main reason against one finger, by the evidence of the score."""
    among = f"the {count(evidence.common, 'minutia', 'minutiae')} of both prints"
    share = f"{count(evidence.pairs, 'pair')} among {among} in the common region"
    if evidence.overlap < SMALL_OVERLAP:
        return f"the common region is small ({evidence.overlap:.0%} of the smaller print): {share}"
    if evidence.cells and evidence.ridges < POOR_RIDGES:
        return f"the ridges disagree under the best transform: {share}"
    if evidence.agreement >= MOSTLY_PAIRED:
        few = "half of the minutiae or more are paired, but they are too few, or agree too poorly"
        return f"{few}: {share}"
    return f"too few minutiae agree under the best transform: {share}"
