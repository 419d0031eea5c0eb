"""95 % intervals of rates.

They come from the bootstrap over fingers. If no error occurs, every draw has none, which limits
nothing: the limit is then one-sided, by Clopper and Pearson, where each finger is one trial,
because its impressions are not independent. Nor are pairs of fingers that share one: for the EER, a
trial is a pair of fingers, each finger in one pair.

References
----------
Clopper, Pearson, "The use of confidence or fiducial limits illustrated in the case of the
binomial", Biometrika 26 (1934); without an error it is about the rule of 3 of ISO/IEC 19795-1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores_set import Trials

MIN_FINGERS: Final = 5  # of a database
MIN_COMPARISONS: Final = 10  # of a kind, where the fingers are not known
CONFIDENCE: Final = 0.95
BOOTSTRAP: Final = "bootstrap"
CLOPPER_PEARSON: Final = "clopper-pearson"
_CHANCE: Final = 0.5  # the EER of guessing, which no limit of an EER exceeds


@dataclass(frozen=True, slots=True)
class Interval:
    """The limits between which a rate lies, as fractions, and the method that gives them.

    By Clopper and Pearson there is one limit: in none of the `trials`, or in each of them, the rate
    shows. A trial is a `unit`: "finger", "pair of fingers", "subject" or, where the fingers are not
    known, "comparison".
    """

    low: float
    high: float
    method: str = BOOTSTRAP
    trials: int = 0
    unit: str = ""


def rate_interval(
    name: str,
    rate: float | None,
    draws: NDArray[np.float64] | None,
    trials: Sequence[Trials],
    *,
    mean: bool = False,
) -> Interval | None:
    """Return the interval of the rate called `name`, of databases pooled or of their `mean`.

    `draws` are its bootstrap replicates. There is no interval where there are too few fingers.
    """
    enough = draws is not None and all(map(_are_enough, trials))
    drawn = interval_of(draws) if enough and draws is not None else None
    if rate is None or 0 < rate < 1:
        return drawn
    known = all(one.fingers for one in trials)
    counts = [_count(name, one) for one in trials]
    number = len(counts) * min(counts) if mean else sum(counts)
    unit = ("pair of fingers" if name == "eer" else "finger") if known else "comparison"
    return wider(drawn, exact_interval(rate, number, unit, highest=_CHANCE if name == "eer" else 1))


def exact_interval(rate: float, trials: int, unit: str, *, highest: float = 1) -> Interval | None:
    """Return the limit of a rate of 0 or 1; None without trials, or if it exceeds `highest`."""
    from scipy.stats import binomtest  # noqa: PLC0415  (imports for half a second)

    if not trials:
        return None
    side: Literal["greater", "less"] = "greater" if rate else "less"
    limits = binomtest(trials if rate else 0, trials, alternative=side).proportion_ci(CONFIDENCE)
    low, high = (float(limits.low), 1.0) if rate else (0.0, float(limits.high))
    return Interval(low, high, CLOPPER_PEARSON, trials, unit) if high <= highest else None


def wider(drawn: Interval | None, exact: Interval | None) -> Interval | None:
    """Return the wider of two intervals, either of which may be missing."""
    known = [one for one in (exact, drawn) if one is not None]
    return max(known, key=lambda one: one.high - one.low, default=None)


def interval_of(draws: NDArray[np.float64]) -> Interval | None:
    """Return the limits that leave out 2.5 % of the draws on either side.

    Draws without a rate are NaN; where these are half of them or more, there is no interval.
    """
    known = draws[np.isfinite(draws)]
    if known.size <= draws.size / 2:
        return None
    low, high = np.quantile(known, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(float(low), float(high))


def interval_json(interval: Interval | None) -> list[float] | None:
    """Return the limits as JSON values."""
    return None if interval is None else [interval.low, interval.high]


def bound_json(interval: Interval | None) -> dict[str, Any] | None:
    """Return the basis of an interval with one limit as JSON values; None for any other."""
    if interval is None or interval.method == BOOTSTRAP:
        return None
    return {"unit": interval.unit, "units": interval.trials, "method": interval.method}


def _are_enough(trials: Trials) -> bool:
    """Return whether there are enough fingers or, where they are not known, comparisons."""
    if trials.fingers:
        return trials.fingers >= MIN_FINGERS
    genuine = int(trials.genuine.sum())
    return min(genuine, trials.genuine.size - genuine) >= MIN_COMPARISONS


def _count(name: str, trials: Trials) -> int:
    """Return the number of independent trials of a database for a rate of 0 or 1.

    For the EER it is that of the FNMR or of the FMR, whichever has fewer and so the higher limit.
    """
    genuine = trials.genuine
    if not trials.fingers:
        of_kinds = [int(genuine.sum()), int((~genuine).sum())]
        return min(of_kinds) if name == "eer" else of_kinds[0]
    mated = np.unique(trials.probe[genuine]).size
    if name != "eer":
        return mated
    others = np.unique([trials.probe[~genuine], trials.reference[~genuine]]).size
    return min(mated, others // 2)
