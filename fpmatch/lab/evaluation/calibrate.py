"""Calibration of a matcher's similarities: the FMR at each, measured on impostor comparisons.

- Up to the similarity that `MIN_ABOVE` impostors reach, the FMR at a
  similarity x is the share of impostors at x or above it. Knots, at most half a unit of score apart
  unless the curve jumps, represent this curve.
- Beyond, the excesses over a high similarity are modelled by a generalised Pareto distribution,
  the limit that the tails of nearly all distributions approach (Pickands 1975). Its shape is kept
  at 0.2 or above, a heavy tail. A bounded tail would give unlimited scores just above the highest
  impostor, and an exponential one an FMR of 1 in 10 billion to most genuine comparisons, which a
  few hundred fingers of unrelated persons cannot support.

References
----------
Pickands, "Statistical inference using extreme order statistics", Annals of Statistics 3 (1975).
Hosking, Wallis, "Parameter and quantile estimation for the generalized Pareto distribution",
Technometrics 29 (1987), for the fit by probability-weighted moments.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import Calibration, Provenance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.lab.evaluation.impostors import ImpostorSet

_TINY: Final = 1e-290  # below, numbers lose digits
_DIGITS: Final = 9  # significant digits kept, so that files do not differ by rounding

MIN_IMPOSTORS: Final = 1000
MIN_ABOVE: Final = 20  # the empirical curve ends where fewer impostors than this are at or above
TAIL_SHARE: Final = 0.01  # of the impostors, the highest, to which the tail is fitted
MIN_TAIL: Final = 100  # impostors to which the tail is fitted, at least
MIN_SHAPE: Final = 0.2
MAX_SHAPE: Final = 0.5  # where the variance becomes infinite
KNOT_STEP: Final = 0.5  # greatest distance between knots in score


def calibrate_on(
    sets: Sequence[ImpostorSet],
    matcher: str,
    command: str = "",
    *,
    shares: Sequence[float] | None = None,
) -> Calibration:
    """Fit a calibration to the impostor comparisons of some databases together.

    With ten fingers a database, the FMR below one in a thousand is an extrapolation with a wide
    confidence interval, since comparisons of the same two fingers are not independent. `sets`: the
    comparisons; see `fpmatch.lab.evaluation.impostors.gather_impostors`. `matcher`, `command`:
    names for the provenance of the calibration. `shares`: weights of the databases (default: every
    comparison has the same weight). Raises a `MatcherError` if there are too few impostor
    comparisons, or too few distinct similarities.
    """
    impostors = np.concatenate([one.trials.similarity for one in sets])
    provenance = Provenance(
        sets=tuple(one.name for one in sets),
        impostors=int(impostors.size),
        version=__version__,
        command=command,
        matcher=matcher,
        fingers=sum(one.trials.fingers for one in sets),
    )
    weights = None
    if shares is not None:
        counts = np.array([len(one.trials.similarity) for one in sets])
        weights = np.repeat(np.asarray(shares, np.float64) / np.maximum(counts, 1), counts)
    return replace(fit_calibration(impostors, weights), provenance=provenance)


def fit_calibration(
    impostor_similarities: ArrayLike, weights: ArrayLike | None = None
) -> Calibration:
    """Fit a calibration, without provenance, to similarities of impostor comparisons.

    `impostor_similarities`, `weights` (N,): the similarities, in any order, and their weights
    (default: all the same). Raises a `MatcherError` if there are too few similarities, too few
    distinct ones, or one is not finite.

    Examples
    --------
    >>> import math
    >>> import numpy as np
    >>> from fpmatch.lab.evaluation.calibrate import fit_calibration
    >>> unit_tail = np.random.default_rng(1).exponential(size=20_000)
    >>> fit_calibration(unit_tail).score(math.log(1000)).__round__()
    30
    """
    s = np.asarray(impostor_similarities, dtype=np.float64).ravel()
    w = np.ones(s.size) if weights is None else np.asarray(weights, dtype=np.float64).ravel()
    order = np.lexsort((w, s))
    s, w = s[order], w[order]
    if not np.isfinite(s).all():
        raise MatcherError("calibration: impostor similarities must be finite numbers")
    s[np.abs(s) < _TINY] = 0.0
    if s.size < MIN_IMPOSTORS:
        raise MatcherError(
            f"calibration: {s.size} impostor comparisons are too few; "
            f"at least {MIN_IMPOSTORS} are needed"
        )
    knots = _empirical_knots(s, w)
    scale, shape = _tail_at(knots[-1][0], s, w)
    return Calibration(knots, _rounded(scale), _rounded(shape))


def _empirical_knots(
    s: NDArray[np.float64], w: NDArray[np.float64]
) -> tuple[tuple[float, float], ...]:
    """Return knots of the curve x -> -10 log10(share of impostors at or above x); s is sorted."""
    x, first = np.unique(s, return_index=True)
    above = s.size - first
    kept = above >= min(MIN_ABOVE, s.size)
    weight_above = np.cumsum(w[::-1])[::-1]
    share = weight_above[first[kept]] / weight_above[0]
    x, score = x[kept], -10.0 * np.log10(np.minimum(share, 1.0)) + 0.0
    steps = np.arange(0.0, score[-1], KNOT_STEP)
    chosen = np.searchsorted(score, steps)
    # Two knots represent a jump, which would else become a slope from the knot before.
    jumps = 1 + np.flatnonzero(np.diff(score) > KNOT_STEP)
    index = np.unique(np.concatenate([chosen, jumps - 1, jumps, [score.size - 1]]))
    # The first of the knots whose similarities do not differ once they are rounded.
    knots: dict[float, float] = {}
    for k in index:
        knots.setdefault(_rounded(x[k]), _rounded(score[k]))
    return tuple(knots.items())


def _tail_at(last: float, s: NDArray[np.float64], w: NDArray[np.float64]) -> tuple[float, float]:
    """Return scale and shape of the generalised Pareto tail above the similarity `last`.

    Excesses over a higher threshold keep the shape, and the scale grows by shape times the rise.
    """
    above = np.cumsum(w[::-1])
    count = round(float(np.searchsorted(above, TAIL_SHARE * above[-1])))
    start = s[-min(max(MIN_TAIL, count) + 1, s.size)]
    tail = s > start
    excess = s[tail] - start
    if not excess.size:
        raise MatcherError(
            "calibration: the highest impostor similarities are all the same; no tail can be fitted"
        )
    scale, shape = _fit_pareto(excess, w[tail])
    return scale + shape * max(last - start, 0.0), shape


def _fit_pareto(excess: NDArray[np.float64], w: NDArray[np.float64]) -> tuple[float, float]:
    """Fit scale and shape (in Hosking and Wallis's sign, -k) to sorted positive excesses.

    With α0 the mean and α1 the mean of x·(1 - F(x)), the moments give k = α0/(α0 - 2α1) - 2 and
    scale = 2·α0·α1/(α0 - 2α1). Where the shape -k leaves its limits it is held at that limit,
    and the scale is what then gives the mean: α0·(1 - shape).
    """
    total = float(w.sum())
    mean = float(w @ excess) / total
    above = np.maximum(total - np.cumsum(w), 0.0) / np.maximum(total - w, 1e-300)
    weighted = float(w @ (excess * above)) / total
    spread = mean - 2.0 * weighted
    shape = 2.0 - mean / spread if spread > 0 else 0.0
    shape = min(max(shape, MIN_SHAPE), MAX_SHAPE)
    return mean * (1.0 - shape), shape


def _rounded(value: float | np.float64) -> float:
    return float(f"{value:.{_DIGITS}g}")
