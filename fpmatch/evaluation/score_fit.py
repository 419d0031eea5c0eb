"""Learn the weights of the default matcher's score from comparisons whose truth is known.

It is logistic regression with five particulars.

- Impostor comparisons weigh more than genuine ones: what matters is where few impostors are left,
  and the balanced fit looks at where the two kinds overlap most.
- A share of the genuine comparisons is taken for lost: nothing in common was found, and their
  features are those of impostors. Without it these few pull the fit away from all others.
- Every database, and in it every kind, has the same weight, however many its comparisons.
- Prints whose codes have too little in common are dismissed at a glance. What is enough grows with
  the smaller print; of all such lines under which hardly a genuine comparison is lost that would
  not be lost at the first look, that is taken which dismisses the most of the impostors.
- Of the ways in which two prints can be laid on one another that counts for which the minutiae
  speak the most. Which one that is, the weights say, so that choosing and fitting take turns.

It is solved by Newton's steps, the lost share by expectation and maximisation between them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.evaluation.protocol import choose_pairs
from fpmatch.evaluation.rates import error_rates
from fpmatch.matching.align import AlignmentParameters, candidates, sketches
from fpmatch.matching.codes import common
from fpmatch.matching.local import local_likeness, most_alike
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.one_to_many import MIN_MINUTIAE
from fpmatch.matching.score import (
    FEATURES,
    NO_GLANCE,
    ScoreWeights,
    gather_evidence,
    scales,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.extraction import ExtractedSet
    from fpmatch.matching._evidence_kernel import Scales
    from fpmatch.matching.prepare import PreparedTemplate


OF_RIDGES: Final = np.array(["ridges" in name for name in FEATURES])


@dataclass(frozen=True, slots=True)
class FitParameters:
    """Set the fit.

    Parameters
    ----------
    impostor_weight : float
        Weight of all impostor comparisons together against that of all genuine ones.
    lost_share : float
        Share of the genuine comparisons that are taken for lost.
    ridge : float
        Penalty on the squared weights of the standardised features.
    rounds, settled : int, float
        Steps at most, and the change of the weights at which they end.
    longest_step : float
        Largest change of a weight in a step.
    digits : int
        Significant digits kept, so that rounding in other orders of summing changes nothing.
    every_impostor : int
        Of so many impostor comparisons of a database one is taken.
    looked_at : float
        Share of the impostor comparisons that a first look at the minutiae leaves a doubt of, so
        that they are refined and their ridges looked at.
    unsure : float
        Share of the impostor comparisons whose best alignment at the first look is refined alone.
    dismissed : float
        Share of the genuine comparisons that pass the first look which the codes may dismiss.
    most_asked : float
        The most that codes must say, of however many minutiae: where a print has a great many, most
        are spurious, and those that are not say no more than in another print.
    steepest, slopes : float, int
        What the codes must say more a minutia, at most, and how many such slopes are tried.
    turns : int
        How many times to choose and to fit.
    """

    impostor_weight: float = 10.0
    lost_share: float = 0.03
    ridge: float = 2e-5
    rounds: int = 200
    settled: float = 1e-9
    longest_step: float = 2.0
    digits: int = 6
    every_impostor: int = 4
    looked_at: float = 0.25
    unsure: float = 0.001
    dismissed: float = 0.0005
    most_asked: float = 30.0
    steepest: float = 3.0
    slopes: int = 61
    turns: int = 4


@dataclass(frozen=True, slots=True, eq=False)
class ScoreSample:
    """Hold the comparisons of one database.

    Parameters
    ----------
    name : str
        The database.
    features : ndarray of float64, shape (N, C, 6)
        Those of the comparisons that found something, of each way to lay the prints on one another,
        that of most support first; NaN where there are fewer. See
        `fpmatch.matching.score.FEATURES`.
    first : ndarray of float64, shape (N, C, 6)
        Those of a first look, see `fpmatch.matching.align.sketches`, at the minutiae alone.
    codes : ndarray of float64, shape (N, 2)
        What their codes have in common, and the minutiae of the smaller print.
    genuine : ndarray of bool, shape (N,)
        Whether both prints are of one finger.
    nothing : tuple of int
        Numbers of the other genuine and impostor comparisons.
    """

    name: str
    features: NDArray[np.float64]
    first: NDArray[np.float64]
    codes: NDArray[np.float64]
    genuine: NDArray[np.bool_]
    nothing: tuple[int, int]


def sample_of(extracted: ExtractedSet, parameters: FitParameters | None = None) -> ScoreSample:
    """Compare the impressions of a database with one another.

    Parameters
    ----------
    extracted : ExtractedSet
        The database and its templates, which must show their ridges.
    parameters : FitParameters, optional
        What share of the impostors to take.

    Returns
    -------
    ScoreSample
        All genuine comparisons, and every so many of the others.
    """
    p = parameters or FitParameters()
    pairs = choose_pairs(extracted.dataset.impressions)
    prints = [
        None if one.template is None else MATCHER.prepare(one.template)
        for one in extracted.extractions
    ]
    on = scales(max((len(one) for one in prints if one), default=0), _no_weights())
    rows: list[NDArray[np.float64]] = []
    codes, genuine, nothing, passed = [], [], [0, 0], 0
    for i, j, same in zip(pairs.probe, pairs.reference, pairs.genuine, strict=True):
        passed += not same
        if not same and passed % p.every_impostor:
            continue
        a, b = prints[i], prints[j]
        row = None if a is None or b is None else _features(a, b, on)
        if a is None or b is None or row is None:
            nothing[0 if same else 1] += 1
        else:
            rows.append(row)
            codes.append(_codes_of(a, b))
            genuine.append(bool(same))
    shape = (len(rows), 2, AlignmentParameters().candidates, len(FEATURES))
    features = np.array(rows).reshape(shape)
    return ScoreSample(
        extracted.dataset.name,
        features[:, 0],
        features[:, 1],
        np.array(codes, np.float64).reshape(-1, 2),
        np.array(genuine, bool),
        (nothing[0], nothing[1]),
    )


def _no_weights() -> ScoreWeights:
    """Return what weighs nothing and looks at all ridges."""
    standard = np.zeros((4, len(FEATURES)))
    standard[1] = 1.0
    return ScoreWeights(standard, 0.0, NO_GLANCE, -1.0, np.inf, {})


def _codes_of(probe: PreparedTemplate, reference: PreparedTemplate) -> tuple[int, int]:
    """Return what the codes of two prints have in common, and the minutiae of the smaller."""
    a, b = sorted((probe, reference), key=lambda side: side.key)
    return common(a.codes, b.codes), min(len(a), len(b))


def _features(
    probe: PreparedTemplate, reference: PreparedTemplate, on: Scales
) -> NDArray[np.float64] | None:
    """Return the features of two prints, shape (2, C, 6), their ridges looked at in any case.

    The second are those of the first look.
    """
    a, b = sorted((probe, reference), key=lambda side: side.key)
    if min(len(a), len(b)) < MIN_MINUTIAE:
        return None
    likeness = local_likeness(a.neighbourhoods, b.neighbourhoods)
    seeds = most_alike(likeness)
    laid = [lay(a.points, b.points, seeds) for lay in (candidates, sketches)]
    if not all(laid):
        return None
    found = np.full((2, AlignmentParameters().candidates, len(FEATURES)), np.nan)
    for ways, row in zip(laid, found, strict=True):
        for k, alignment in enumerate(ways):
            row[k] = gather_evidence(a, b, alignment, likeness, on).features
    return found


def fit_weights(
    samples: Sequence[ScoreSample],
    *,
    without: Collection[str] = (),
    command: str = "",
    parameters: FitParameters | None = None,
) -> ScoreWeights:
    """Learn the weights.

    Parameters
    ----------
    samples : sequence of ScoreSample
        The databases.
    without : collection of str
        Features that are to have no weight.
    command : str
        What ran it, kept in the provenance.
    parameters : FitParameters, optional
        How to fit.

    Returns
    -------
    ScoreWeights
        The same for the same samples.
    """
    p = parameters or FitParameters()
    every = np.concatenate([one.features for one in samples])
    genuine = np.concatenate([one.genuine for one in samples])
    share = np.concatenate([_shares(one) for one in samples]) / len(samples)
    used = np.array([name not in without for name in FEATURES])
    x = every[:, 0]
    for _ in range(p.turns):
        standard, bias = _fit(x, genuine, share, used, p)
        x = _chosen(every, standard, bias)[0]
    provenance: dict[str, Any] = {
        "sets": [one.name for one in samples],
        "genuine": int(genuine.sum()),
        "impostors": int((~genuine).sum()),
        "version": __version__,
        "command": command,
    }
    at_first = _chosen(np.concatenate([one.first for one in samples]), standard, bias)[1]
    passed = np.quantile(at_first[~genuine], [1.0 - p.looked_at, 1.0 - p.unsure])
    gate, sure = _rounded(passed, p.digits).tolist()
    codes = np.concatenate([one.codes for one in samples])
    glance = _glance(codes[genuine & (at_first > gate)], codes[~genuine], p)
    return ScoreWeights(standard, bias, glance, gate, sure, provenance)


def _glance(
    passing: NDArray[np.float64], impostors: NDArray[np.float64], p: FitParameters
) -> tuple[float, float, float]:
    """Return what codes must say: so much, so much more a minutia of the smaller print, the most.

    Both are rows as of `ScoreSample.codes`; of `passing`, all but a share must pass.
    """
    if not len(passing) or not len(impostors):
        return NO_GLANCE
    lost = int(p.dismissed * len(passing))
    found = []
    certain = passing[:, 0] >= p.most_asked
    for slope in np.linspace(0.0, p.steepest, p.slopes):
        left = np.where(certain, p.most_asked, passing[:, 0] - slope * passing[:, 1])
        base = float(np.sort(left)[lost])
        asked = np.minimum(base + slope * impostors[:, 1], p.most_asked)
        found.append((np.count_nonzero(impostors[:, 0] < asked), base, float(slope)))
    _, base, slope = max(found)
    base, slope = _rounded(np.array([base, slope]), p.digits).tolist()
    return base, slope, p.most_asked


def _fit(
    x: NDArray[np.float64],
    genuine: NDArray[np.bool_],
    share: NDArray[np.float64],
    used: NDArray[np.bool_],
    p: FitParameters,
) -> tuple[NDArray[np.float64], float]:
    """Return what is known of each feature, as `ScoreWeights.standard` has it, and the bias."""
    means = [share[k] @ x[k] / share[k].sum() for k in (genuine, ~genuine)]
    middle = _rounded((means[0] + means[1]) / 2, p.digits)
    spread = _rounded(np.sqrt(share @ (x - middle) ** 2 / share.sum()), p.digits)
    z = np.column_stack([((x - middle) / spread)[:, used], np.ones(len(x))])
    found = _newton(z, genuine, share, p)
    weight = np.zeros(len(FEATURES))
    weight[used] = _rounded(found[:-1], p.digits)
    stranger = _rounded(means[1], p.digits)
    return np.stack([middle, spread, weight, stranger]), float(_rounded(found[-1:], p.digits)[0])


def _chosen(
    every: NDArray[np.float64], standard: NDArray[np.float64], bias: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the features of each comparison as the minutiae choose, and the minutiae's sums."""
    middle, spread, weight, stranger = standard
    of_minutiae = bias + (np.where(OF_RIDGES, stranger, every) - middle) / spread @ weight
    of_minutiae = np.where(np.isnan(every[..., 0]), -np.inf, of_minutiae)
    best = of_minutiae.argmax(axis=1)
    rows = np.arange(len(every))
    return every[rows, best], of_minutiae[rows, best]


def rates_of(samples: Sequence[ScoreSample], weights: Sequence[ScoreWeights]) -> dict[str, Any]:
    """Return the error rates of databases, each weighed by its own weights, in percent.

    Parameters
    ----------
    samples : sequence of ScoreSample
        The databases.
    weights : sequence of ScoreWeights
        One for each.

    Returns
    -------
    dict
        Under ``"sets"``, ``"mean"`` and ``"pooled"`` the EER and the FNMR at an FMR of 0.1 %.
    """
    scores = [_sums(*row) for row in zip(samples, weights, strict=True)]
    sets = [_rates(*row) for row in scores]
    mean = {name: round(float(np.mean([one[name] for one in sets])), 3) for name in sets[0]}
    pooled = _rates(*(np.concatenate(kind) for kind in zip(*scores, strict=True)))
    named = {one.name: row for one, row in zip(samples, sets, strict=True)}
    return {"mean": mean, "pooled": pooled, "sets": named}


def _shares(sample: ScoreSample) -> NDArray[np.float64]:
    """Return the weight of each comparison: together 1 a kind."""
    genuine = int(sample.genuine.sum())
    impostors = len(sample.genuine) - genuine
    return np.asarray(np.where(sample.genuine, 1.0 / max(genuine, 1), 1.0 / max(impostors, 1)))


def _newton(
    z: NDArray[np.float64],
    genuine: NDArray[np.bool_],
    share: NDArray[np.float64],
    p: FitParameters,
) -> NDArray[np.float64]:
    """Return the weights of the columns of `z`, the last of which is one, for even odds."""
    odds = np.log(p.impostor_weight)
    even = np.where(genuine, 1.0, p.impostor_weight) * share / (1.0 + p.impostor_weight)
    penalty = np.full(z.shape[1], p.ridge)
    penalty[-1] = 0.0
    found = np.zeros(z.shape[1])
    found[-1] = -odds
    for _ in range(p.rounds):
        sums = np.clip(z @ found, -500.0, 500.0)
        chance = 1.0 / (1.0 + np.exp(-sums))
        ratio = np.exp(np.clip(sums + odds, -40.0, 40.0))
        kept = (1.0 - p.lost_share) * ratio / (p.lost_share + (1.0 - p.lost_share) * ratio)
        weight = np.where(genuine, even * kept, even)
        slope = z.T @ (weight * (chance - genuine)) + penalty * found
        curve = (z * (weight * chance * (1.0 - chance))[:, None]).T @ z + np.diag(penalty)
        step = np.linalg.solve(curve, slope)
        longest = float(np.abs(step).max())
        found = found - step * min(1.0, p.longest_step / longest) if longest else found
        if longest < p.settled:
            break
    found[-1] += odds
    return found


def _sums(
    sample: ScoreSample, weights: ScoreWeights
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sums of the genuine and the impostor comparisons; least where nothing was found.

    They are in the order of the similarities, which are those of ``log(1 + e^sum)``.
    """
    middle, spread, weight, _ = weights.standard
    features, _ = _chosen(sample.features, weights.standard, weights.bias)
    _, at_first = _chosen(sample.first, weights.standard, weights.bias)
    total = weights.bias + (features - middle) / spread @ weight
    total = np.where(at_first > weights.gate, total, at_first)
    least = float(total.min(initial=0.0)) - 1.0
    kinds = (total[sample.genuine], total[~sample.genuine])
    genuine, impostor = (
        np.append(kind, np.full(count, least))
        for kind, count in zip(kinds, sample.nothing, strict=True)
    )
    return genuine, impostor


def _rates(genuine: NDArray[np.float64], impostor: NDArray[np.float64]) -> dict[str, float]:
    rates = error_rates(genuine, impostor)
    return {
        "eer": round(100.0 * (rates.eer or 0.0), 3),
        "fmr1000": round(100.0 * (rates.fmr1000 or 0.0), 3),
    }


def _rounded(values: NDArray[np.float64], digits: int) -> NDArray[np.float64]:
    return np.array([float(f"{value:.{digits}g}") for value in values])
