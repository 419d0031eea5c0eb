"""95 % intervals of error rates, by the bootstrap over fingers: how they scatter with others.

The comparisons of a database are not independent: a poor finger affects all its pairs. Fingers are
therefore drawn with replacement, as many as there are, never single comparisons; where they are not
known, there is no interval. A finger drawn w times counts w times in each of its genuine pairs; a
pair of fingers drawn v and w times counts v·w times as an impostor pair. A finger is never an
impostor to a copy of itself.

If no error occurs, every draw has none, which limits nothing: the limit is then one-sided, by
Clopper and Pearson, where each finger is one trial, because its impressions are not independent.
Nor are pairs of fingers that share one: for the EER, a trial is a pair of fingers, each finger in
one pair.

References
----------
Snijders, Borgatti, "Non-parametric standard errors and tests for network statistics", Connections
22 (1999), for the bootstrap of what is measured between pairs. Bolle, Ratha, Pankanti, "Error
analysis of pattern recognition systems: the subsets bootstrap", CVIU 93 (2004), for fingers.
Clopper, Pearson, "The use of confidence or fiducial limits illustrated in the case of the
binomial", Biometrika 26 (1934); without an error it is about the rule of 3 of ISO/IEC 19795-1.
"""

from __future__ import annotations

from bisect import bisect_left
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.random import default_rng

from fpmatch.lab.evaluation.rates.error_rates import FMR_LIMITS, ROUNDING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.rates.scores import Trials

    Counts = NDArray[np.int64]
    Floats = NDArray[np.float64]
    Limits = list[float] | None
    Bound = dict[str, Any] | None

BOOTSTRAPPED: Final = ("eer", *FMR_LIMITS)
"""The rates that have an interval; ZeroFMR and ZeroFNMR depend on one extreme score each."""
DEFAULT_BOOTSTRAP: Final = 1000
MIN_FINGERS: Final = 5  # of a database
CONFIDENCE: Final = 0.95
BOOTSTRAP: Final = "bootstrap"
CLOPPER_PEARSON: Final = "clopper-pearson"
CHANCE: Final = 0.5  # the EER of guessing, which no limit of an EER exceeds


def draw_fingers(fingers: int, bootstrap: int, seed: int, set_index: int = 0) -> Counts:
    """Return how often each finger was drawn in each of `bootstrap` draws of all fingers.

    The array has the shape (bootstrap, fingers). Each database has its own draws.
    """
    chances = np.full(fingers, 1 / fingers)
    return default_rng([seed, set_index]).multinomial(fingers, chances, size=bootstrap)


def bootstrap_rates(
    trials: Sequence[Trials],
    bootstrap: int,
    seed: int,
    limits: Sequence[float] = tuple(FMR_LIMITS.values()),
) -> tuple[Floats, Floats]:
    """Compute the EER, and the FNMR at each FMR of `limits`, for draws of each database's fingers.

    Returns arrays (databases, draws, rates) and, of all databases' scores under one threshold,
    (draws, rates); NaN where a draw left no pairs of a kind, or fingers are not known. The same
    seed draws the same fingers, whatever the similarities, so that two runs over the same prints
    can be compared draw by draw.
    """
    sets = np.full((len(trials), bootstrap, 1 + len(limits)), np.nan)
    pooled = sets[0].copy()
    if not all(one.fingers for one in trials):
        return sets, pooled
    draws = [draw_fingers(one.fingers, bootstrap, seed, k) for k, one in enumerate(trials)]
    ranked, together = [RankedScores([one]) for one in trials], RankedScores(trials)
    for n in range(bootstrap):
        for k, one in enumerate(ranked):
            sets[k, n] = one.rates(draws[k][n], limits)
        pooled[n] = sets[0, n]
        if len(trials) > 1:
            pooled[n] = together.rates(np.concatenate([drawn[n] for drawn in draws]), limits)
    return sets, pooled


def bootstrap_fmr(impostors: Sequence[Trials], threshold: float) -> Floats:
    """Return the FMR at a threshold for draws of fingers, databases pooled; NaN if undefined."""
    matches, total = np.zeros((2, DEFAULT_BOOTSTRAP))
    for k, one in enumerate(impostors):
        reached = one.similarity >= threshold
        for n, counts in enumerate(draw_fingers(one.fingers, DEFAULT_BOOTSTRAP, 0, k)):
            weights = counts[one.probe] * counts[one.reference]
            matches[n] += weights @ reached
            total[n] += weights.sum()
    with np.errstate(invalid="ignore"):
        return np.asarray(matches / total)


class RankedScores:
    """The order of the scores of some databases, so that a draw needs only counts of its units.

    Units are the fingers, else the comparisons, of one database after the other. A pair counts as
    often as its first unit was drawn times its second one, -1 for none.
    """

    def __init__(self, trials: Sequence[Trials]) -> None:
        sides, units = [], 0
        for one in trials:
            second = np.where(one.genuine, -1, one.reference + units)
            pairs = one.probe + units, second
            if not one.fingers:
                pairs = np.arange(one.genuine.size) + units, np.full(one.genuine.size, -1)
            sides.append(np.stack(pairs))
            units += one.fingers or one.genuine.size
        similarity = np.concatenate([one.similarity for one in trials])
        genuine = np.concatenate([one.genuine for one in trials])
        order = np.lexsort((similarity, ~genuine))
        kinds = np.split(order, [genuine.sum()])
        self._pairs = [np.concatenate(sides, axis=1)[:, kind] for kind in kinds]
        ours, theirs = (similarity[kind] for kind in kinds)
        threshold = np.append(np.unique(similarity), np.inf)
        self._below = [np.searchsorted(scores, threshold).tolist() for scores in (ours, theirs)]
        self._genuine_up_to = np.searchsorted(ours, theirs, side="right")

    def rates(self, counts: Counts, limits: Sequence[float]) -> Floats:
        """Return the EER and the FNMR at the FMRs of `limits` for a draw; NaN without both kinds.

        `counts` (units,) is how often each unit was drawn.
        """
        drawn = np.append(counts, 1)
        genuine, impostor = (
            np.append(0, np.cumsum(drawn[first] * drawn[second])) for first, second in self._pairs
        )
        if not genuine[-1] or not impostor[-1]:
            return np.full(1 + len(limits), np.nan)

        def errors(threshold: int) -> tuple[float, float]:
            """Return FMR and FNMR at a threshold, by its number."""
            accepted = impostor[-1] - impostor[self._below[1][threshold]]
            return accepted / impostor[-1], genuine[self._below[0][threshold]] / genuine[-1]

        def is_crossed(threshold: int) -> bool:
            fmr, fnmr = errors(threshold)
            return fmr <= fnmr

        after = bisect_left(range(len(self._below[0])), True, key=is_crossed)
        (x0, y0), (x1, y1) = errors(after - 1), errors(after)
        eer = x0 + (x0 - y0) / ((x0 - y0) + (y1 - x1)) * (x1 - x0)
        needed = impostor[-1] - np.floor(np.multiply(limits, impostor[-1]) + ROUNDING)
        rejected = self._genuine_up_to[np.searchsorted(impostor, needed) - 1]
        return np.append(eer, genuine[rejected] / genuine[-1])


def rate_interval(
    name: str,
    rate: float | None,
    draws: Floats,
    trials: Sequence[Trials],
    *,
    mean: bool = False,
) -> tuple[Limits, Bound]:
    """Return the interval of the rate called `name`, of databases pooled or of their `mean`.

    `draws` are its bootstrap replicates. There is no interval where there are too few fingers, or
    some are not known. See `with_limit`.
    """
    if rate is None or not all(one.fingers for one in trials):
        return None, None
    enough = min(one.fingers for one in trials) >= MIN_FINGERS
    drawn = interval_of(draws) if enough else None
    counts = [_count(name, one) for one in trials]
    number = len(counts) * min(counts) if mean else sum(counts)
    if name == "eer":
        return with_limit(drawn, rate, number, "pair of fingers", highest=CHANCE)
    return with_limit(drawn, rate, number, "finger")


def with_limit(
    drawn: Limits, rate: float, trials: int, unit: str, *, highest: float = 1
) -> tuple[Limits, Bound]:
    """Return the interval of a rate, of 0 or 1 the limit of so many trials, if that is wider.

    A limit above `highest` states nothing, and gives no interval. The basis of a limit is returned
    beside it as JSON values: in none of the trials, or in each of them, the rate shows.
    """
    if 0 < rate < 1 or not trials:
        return drawn, None
    least = (1 - CONFIDENCE) ** (1 / trials)  # which solves p^n = 0.05
    low, high = (least, 1.0) if rate else (0.0, 1 - least)
    if high > highest or (drawn is not None and drawn[1] - drawn[0] > high - low):
        return drawn, None
    return [low, high], {"unit": unit, "units": trials, "method": CLOPPER_PEARSON}


def interval_of(draws: Floats) -> Limits:
    """Return the limits that leave out 2.5 % of the draws on either side.

    Draws without a rate are NaN; where these are half of them or more, there is no interval.
    """
    known = draws[np.isfinite(draws)]
    if known.size <= draws.size / 2:
        return None
    limits: list[float] = np.quantile(known, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2]).tolist()
    return limits


def _count(name: str, trials: Trials) -> int:
    """Return the number of independent trials of a database for a rate of 0 or 1.

    For the EER it is that of the FNMR or of the FMR, whichever has fewer and so the higher limit.
    """
    genuine = trials.genuine
    mated = np.unique(trials.probe[genuine]).size
    if name != "eer":
        return mated
    others = np.unique([trials.probe[~genuine], trials.reference[~genuine]]).size
    return min(mated, others // 2)
