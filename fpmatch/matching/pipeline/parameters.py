"""Names of the parameters until kernels, reference and tests have the flat ones."""

from fpmatch.matching.parameters import USUAL as USUAL
from fpmatch.matching.parameters import LocalNumbers, MatchParameters

AlignmentParameters = RelaxationParameters = PairMeshParameters = MatchParameters
RidgeSearchParameters = ScoreParameters = MatchParameters


def LocalParameters(**given: float) -> LocalNumbers:  # noqa: N802
    """Return the numbers of the local match."""
    return LocalNumbers(MatchParameters(**given))
