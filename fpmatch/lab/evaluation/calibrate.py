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

from collections import Counter
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.base.parameters import parameters_of
from fpmatch.errors import DatasetError, MatcherError
from fpmatch.gallery.listing.manifest import kind_of
from fpmatch.lab.evaluation.rates.bootstrap import bootstrap_fmr, interval_of
from fpmatch.lab.evaluation.rates.scores import choose_matcher, read_scores
from fpmatch.lab.evaluation.run import evaluate_matchers, load_datasets
from fpmatch.matching.calibration import Calibration, score_to_fmr
from fpmatch.matching.matchers.unit_circle import UnitCircleMatcher
from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from fpmatch.lab.evaluation.rates.scores import Trials
    from fpmatch.matching.result import Matcher


_TINY: Final = 1e-290  # below, numbers lose digits
_DIGITS: Final = 9  # significant digits kept, so that files do not differ by rounding

MIN_IMPOSTORS: Final = 1000
MIN_ABOVE: Final = 20  # the empirical curve ends where fewer impostors than this are at or above
TAIL_SHARE: Final = 0.01  # of the impostors, the highest, to which the tail is fitted
MIN_TAIL: Final = 100  # impostors to which the tail is fitted, at least
MIN_SHAPE: Final = 0.2
MAX_SHAPE: Final = 0.5  # where the variance becomes infinite
KNOT_STEP: Final = 0.5  # greatest distance between knots in score


def gather_impostors(
    sources: Sequence[str | os.PathLike[str]],
    *,
    matcher: str | Matcher = DEFAULT_MATCHER,
    naming: Mapping[str, Any] = MappingProxyType({}),
    **how: Any,
) -> list[Trials]:
    """Return the impostor comparisons of files of scores, then of databases of prints.

    `sources`: files, of which the scores of the matcher are read, and folders and manifests, whose
    prints are compared by the extended protocol. In place of the default matcher, the one whose
    similarities are not lowered by the pairs that chance makes compares and is read: fitted to
    lowered ones, a calibration would raise them again. `how` is as for `evaluate_matchers`,
    `naming` as for `load_datasets`. Raises a `DatasetError` if a source cannot be used, or a
    database comes twice; a `MatcherError` if the matcher is unknown.
    """
    given = chosen = get_matcher(matcher) if isinstance(matcher, str) else matcher
    if isinstance(given, UnitCircleMatcher):  # its highest similarities are lowered by chance pairs
        own = {name: one.value for name, one in parameters_of(given.parameters).items()}
        chosen = type(given)(**own | {"beyond_share": 0.0})
    gathered = []
    files = [source for source in sources if kind_of(source) == "file"]
    for file in files:
        sets = read_scores(file)
        if {one.matcher for one in sets} == {given.name} != {chosen.name}:
            why = (
                f"the highest similarities of {given.name} are lowered by the pairs that chance "
                "makes, and a calibration would raise them again; give the prints, or scores of "
                f"fpmatch evaluate --matcher {chosen.name}"
            )
            raise DatasetError(why, path=file)
        gathered += [one.impostors for one in choose_matcher(sets, chosen.name, file)]
    if places := [source for source in sources if source not in files]:
        (report,) = evaluate_matchers(load_datasets(places, **naming), [chosen], **how)
        gathered += report.impostors
    for name, times in Counter(one.name for one in gathered).items():
        if times > 1:
            raise DatasetError(f"{name}: this database is given twice")
    return gathered


def calibrate_on(sets: Sequence[Trials], matcher: str, command: str = "") -> Calibration:
    """Fit a calibration to the impostor comparisons of some databases together.

    With ten fingers a database, the FMR below one in a thousand is an extrapolation with a wide
    confidence interval, since comparisons of the same two fingers are not independent. `sets`: the
    comparisons; see `gather_impostors`. `matcher`, `command`: names for the provenance of the
    calibration. Raises a `MatcherError` if there are too few impostor comparisons or distinct
    similarities.
    """
    impostors = np.concatenate([one.similarity for one in sets])
    provenance = {
        "sets": [one.name for one in sets],
        "impostors": int(impostors.size),
        "version": __version__,
        "command": command,
        "matcher": matcher,
        "fingers": sum(one.fingers for one in sets),
    }
    return replace(fit_calibration(impostors), provenance=provenance)


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


def report_calibration(calibration: Calibration, sets: Sequence[Trials]) -> dict[str, Any]:
    """Return what a calibration of `calibrate_on` is based on, as JSON values.

    The comparisons measure the FMR up to `largest_measured_score`, with a 95 % interval over
    fingers there; above, it is extrapolated.
    """
    largest, provenance = calibration.largest_measured_score, calibration.provenance
    return {
        **{name: provenance[name] for name in ("matcher", "fingers", "impostors")},
        "databases": len(sets),
        "largest_measured_score": largest,
        "smallest_measured_fmr": score_to_fmr(largest),
        "smallest_measured_fmr_interval": (
            interval_of(bootstrap_fmr(sets, calibration.knots[-1][0]))
            if all(one.fingers for one in sets)
            else None
        ),
        "highest_impostor_score": calibration.score(max(one.similarity.max() for one in sets)),
    }
