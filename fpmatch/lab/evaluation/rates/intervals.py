"""95 % intervals of rates.

They come from the bootstrap over fingers. Without an error every draw has none, which limits
nothing: the limit is then that of Clopper and Pearson, one-sided, where each finger is one trial,
because its impressions are not independent. Nor are pairs of fingers that share one, which a finger
that matches many others shows; for the EER, a trial is a pair of fingers, each finger in one pair.

References
----------
Clopper, Pearson, "The use of confidence or fiducial limits illustrated in the case of the
binomial", Biometrika 26 (1934); without an error it is about the rule of 3 of ISO/IEC 19795-1.
Finner, "A generalization of Hölder's inequality and some probability inequalities", Annals of
Probability 20 (1992), for the number of pairs that may be taken as independent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores_set import Trials

MIN_FINGERS: Final = 5  # of a database
MIN_COMPARISONS: Final = 10  # of a kind, where the fingers are not known
CONFIDENCE: Final = 0.95


class Interval(NamedTuple):
    """The limits between which a rate lies, as fractions."""

    low: float
    high: float

    @property
    def excludes_zero(self) -> bool:
        """Whether zero lies outside."""
        return self.low > 0 or self.high < 0


@dataclass(frozen=True, slots=True)
class ExactBound:
    """The basis of an interval with one limit: the method, and the independent trials.

    A trial is a `unit`: "finger", "pair of fingers", "subject" or, where the fingers are not known,
    "comparison". The limit is `CONFIDENCE` sure where in none of the `units`, or in each of them,
    the rate shows.
    """

    unit: str
    units: int
    method: str = "clopper-pearson"

    def interval(self, rate: float) -> Interval:
        """Return the limit of a rate that is 0 or 1, and that rate.

        Of n trials without an error the upper limit p solves (1 - p)^n = 1 - `CONFIDENCE`.
        """
        least = (1 - CONFIDENCE) ** (1 / self.units)
        return Interval(least, 1.0) if rate else Interval(0.0, 1 - least)


def exact_bound(rate: str, trials: Sequence[Trials], *, mean: bool = False) -> ExactBound:
    """Return the basis of the limit of a rate of databases pooled, or of their mean.

    Of the EER it is that of FNMR or FMR, whichever has fewer trials and so the higher limit.
    """
    genuine = combined([_fnmr_bound(t) for t in trials], mean=mean)
    if rate != "eer":
        return genuine
    impostor = combined([_fmr_bound(t) for t in trials], mean=mean)
    return min(genuine, impostor, key=lambda bound: bound.units)


def combined(bounds: Sequence[ExactBound], *, mean: bool = False) -> ExactBound:
    """Return the basis of the limit of databases pooled, or of their mean, from that of each.

    The mean is at most as high as if each database had as few trials as the smallest.
    """
    units = [one.units for one in bounds]
    unit = " or ".join(dict.fromkeys(one.unit for one in bounds))
    return ExactBound(unit, len(units) * min(units) if mean else sum(units))


def drawn_or_exact(
    rate: float, drawn: Interval | None, bound: ExactBound | None
) -> tuple[Interval | None, ExactBound | None]:
    """Return the wider of the bootstrap interval and, of a rate of 0 or 1, the exact limit.

    The second result is `bound` where the limit is that.
    """
    if bound is None or rate not in {0.0, 1.0}:
        return drawn, None
    exact = bound.interval(rate)
    if drawn is not None and drawn.high - drawn.low > exact.high - exact.low:
        return drawn, None
    return exact, bound


def enough_for_interval(trials: Trials) -> bool:
    """Return whether there are enough fingers or, where they are not known, comparisons."""
    if trials.fingers:
        return trials.fingers >= MIN_FINGERS
    genuine = int(trials.genuine.sum())
    return min(genuine, trials.genuine.size - genuine) >= MIN_COMPARISONS


def interval_of(draws: NDArray[np.float64]) -> Interval | None:
    """Return the limits that leave out 2.5 % of the draws on either side.

    Draws without a rate are NaN; where these are half of them or more, there is no interval.
    """
    known = draws[np.isfinite(draws)]
    if known.size <= draws.size / 2:
        return None
    low, high = np.quantile(known, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(float(low), float(high))


def _fnmr_bound(trials: Trials) -> ExactBound:
    """Take each finger with genuine pairs as one trial."""
    if not trials.fingers:
        return ExactBound("comparison", int(trials.genuine.sum()))
    return ExactBound("finger", np.unique(trials.probe[trials.genuine]).size)


def _fmr_bound(trials: Trials) -> ExactBound:
    """Take pairs of fingers as trials, as many of those compared as have no finger in common.

    It is the greatest fractional matching, rounded down: half of the fingers in all pairs of them.
    """
    from scipy.sparse import coo_array  # noqa: PLC0415
    from scipy.sparse.csgraph import maximum_bipartite_matching  # noqa: PLC0415

    impostor = ~trials.genuine
    if not trials.fingers:
        return ExactBound("comparison", int(impostor.sum()))
    pairs = trials.probe[impostor], trials.reference[impostor]
    sides = np.concatenate(pairs), np.concatenate(pairs[::-1])
    shape = (trials.fingers, trials.fingers)
    compared = coo_array((np.ones(sides[0].size), sides), shape=shape).tocsr()
    matched = int(np.count_nonzero(maximum_bipartite_matching(compared) >= 0))
    return ExactBound("pair of fingers", matched // 2)
