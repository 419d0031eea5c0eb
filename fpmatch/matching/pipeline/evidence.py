"""Evidence: what a score is made of, and the reasons against one finger that it gives.

The score is learned by logistic regression on synthetic prints by ``python -m research train
score``. docs/explanation/how_it_works.md describes its features, how their sum is conditioned on
the amount of evidence, and its bounds; `score_model` has the weights. The result is an estimate of
-ln(FMR), on one scale for prints with and without ridges. The similarity, ``log(1 + e^estimate)``,
is positive. Prints that the prefilter rejects get an estimate of -5 or less, by how far they fall
short.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.matching.pipeline.score_model import ScoreWeights, as_similarity
from fpmatch.printable import count

if TYPE_CHECKING:
    from fpmatch.matching.prints.prepared import PreparedTemplate

WEIGHTS_FILE: Final = Path(__file__).with_name("score_data") / "unit-circle.json"


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
    chance: float  # pairs expected where the minutiae in the common region lie there by chance
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


class Alignment(NamedTuple):
    """The best alignment of two prints, A and B, which are in the order of their content."""

    linear: complex  # q = shift + linear·p maps A onto B, at 500 dpi with y pointing up
    shift: complex
    evidence: Evidence
    competing: int  # most pairs of a tried transform that maps A to a very different place


SMALL_OVERLAP: Final = 0.25  # share of the smaller print: the common region is small
POOR_RIDGES: Final = 0.3  # correlation: hardly more than that of impostor prints
MOSTLY_PAIRED: Final = 0.5  # share of the minutiae in the common region: not too few are paired
POOR_MINUTIAE: Final = 0.4  # mean quality of a print's minutiae, 0 to 1
COMPETING_SHARE: Final = 0.75  # of the pairs of the best transform, that a competing one has


@cache
def load_weights() -> ScoreWeights:
    """Return the weights in the package."""
    return ScoreWeights.from_json(WEIGHTS_FILE.read_text(encoding="utf-8"))


def main_reason(evidence: Evidence) -> str:
    """Return the main reason against one finger, by the evidence of the score."""
    among = f"the {count(int(evidence.common), 'minutia', 'minutiae')} of both prints"
    share = f"{count(int(evidence.pairs), 'pair')} among {among} in the common region"
    if evidence.overlap < SMALL_OVERLAP:
        return f"the common region is small ({evidence.overlap:.0%} of the smaller print): {share}"
    if evidence.cells and evidence.ridges < POOR_RIDGES:
        return f"the ridges disagree under the best transform: {share}"
    if evidence.agreement >= MOSTLY_PAIRED:
        few = "half of the minutiae or more are paired, but they are too few, or agree too poorly"
        return f"{few}: {share}"
    return f"too few minutiae agree under the best transform: {share}"


def all_reasons(probe: PreparedTemplate, reference: PreparedTemplate, aligned: Alignment) -> str:
    """Return the reasons against one finger in one line, the main one first."""
    competing = aligned.competing
    parts = [main_reason(aligned.evidence)]
    if 0 < COMPETING_SHARE * aligned.evidence.pairs <= competing:
        parts.append(
            f"another, very different transform pairs {count(competing, 'minutia', 'minutiae')}: "
            "the alignment is ambiguous"
        )
    for name, side in (("probe", probe), ("reference", reference)):
        mean = float(side.quality.mean())
        if mean < POOR_MINUTIAE:
            parts.append(f"the minutiae of the {name} are poor (mean quality {100 * mean:.0f})")
    return "; ".join(parts)
