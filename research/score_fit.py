"""Learn the weights of the default matcher's score from comparisons whose truth is known.

It is logistic regression with five particulars.

- Impostor comparisons weigh more than genuine ones: what matters is where few impostors are left,
  and the balanced fit looks at where the two kinds overlap most.
- A share of the genuine comparisons is taken for lost: nothing in common was found, and their
  features are those of impostors. Without it these few pull the fit away from all others.
- Every database, and in it every kind, has the same weight, however many its comparisons.
- The prefilter rejects prints whose bit descriptors have too low a score. The threshold grows with
  the smaller print; of all such lines under which hardly a genuine comparison is lost that would
  not be lost in coarse alignment, that is taken which rejects the most impostors.
- Of the hypotheses of a comparison the one of the greatest sum counts. Which one that is depends on
  the weights, so that choosing and fitting take turns.

Three models are learned, of the same prints: one with their ridges, one on their minutiae alone,
and one, with their ridges, of windows of the prints as well, for small prints. What their sums are
worth, given how much was compared, is measured by `research.amount_fit`.

It is solved by Newton's steps, the lost share by expectation and maximisation between them.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.evaluation.partial import window
from fpmatch.evaluation.protocol import choose_pairs
from fpmatch.evaluation.rates import error_rates
from fpmatch.matching.align import AlignmentParameters, aligner_of
from fpmatch.matching.bit_descriptors import descriptor_similarity
from fpmatch.matching.local import local_similarity
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.matching.one_to_many import MIN_MINUTIAE
from fpmatch.matching.ridge_search import RidgeSearchParameters
from fpmatch.matching.score import (
    FEATURES,
    MODELS,
    NO_PREFILTER,
    NO_QUANTILES,
    RIDGE_FEATURES,
    SMALL_FEATURES,
    SMALL_WITH_RIDGES,
    WITH_RIDGES,
    ScoreModel,
    ScoreWeights,
    evidence_scorer,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from fpmatch.evaluation.extraction import ExtractedSet
    from fpmatch.matching._evidence_kernel import EvidenceScorer
    from fpmatch.matching.prepare import PreparedTemplate


SEED: Final = 18
LOCAL_HYPOTHESES: Final = AlignmentParameters().hypotheses
HYPOTHESES: Final = LOCAL_HYPOTHESES + RidgeSearchParameters().found
OF_RIDGES: Final = np.array([name in RIDGE_FEATURES for name in FEATURES])


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
    every_impostor, every_window_impostor : int
        Of so many impostor comparisons of a database one is taken, and one of a window.
    windows_px : tuple of int
        Sides of the windows in pixels at 500 dpi.
    refined : float
        Share of the impostor comparisons that coarse alignment leaves in doubt, so that they are
        refined and their ridges compared.
    confident : float
        Share of the impostor comparisons whose best hypothesis in coarse alignment is refined
        alone.
    window_passed : float
        Share of the impostor comparisons that reach the sum above which a genuine comparison found
        by its ridges is not to be rejected by the prefilter.
    prefilter_loss : float
        Share of the genuine comparisons that pass coarse alignment which the prefilter may reject.
    relaxation_loss : float
        Share of those genuine comparisons whose local matches may be taken for weak.
    prefilter_limit : float
        The greatest prefilter threshold, of however many minutiae: where a print has a great many,
        most are spurious, and the others agree in no more bits than in another print.
    steepest, slopes : float, int
        The greatest growth of the prefilter threshold a minutia, and how many slopes are tried.
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
    every_window_impostor: int = 16
    windows_px: tuple[int, ...] = (128, 160)
    refined: float = 0.25
    confident: float = 0.001
    window_passed: float = 0.01
    prefilter_loss: float = 0.0005
    relaxation_loss: float = 0.002
    prefilter_limit: float = 30.0
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
    features : ndarray of float64, shape (N, H, 13)
        Those of the comparisons that found something, of each hypothesis, refined, its ridges
        compared; NaN where there are fewer. See `fpmatch.matching.score.FEATURES`.
    coarse : ndarray of float64, shape (N, H, 13)
        Those in coarse alignment, of the minutiae alone.
    descriptors : ndarray of float64, shape (N, 2)
        The prefilter's score, and the minutiae of the smaller print.
    strength : ndarray of float64, shape (N,)
        That of the relaxed local matches.
    genuine : ndarray of bool, shape (N,)
        Whether both prints are of one finger.
    nothing : tuple of int
        Numbers of the other genuine and impostor comparisons.
    """

    name: str
    features: NDArray[np.float64]
    coarse: NDArray[np.float64]
    descriptors: NDArray[np.float64]
    strength: NDArray[np.float64]
    genuine: NDArray[np.bool_]
    nothing: tuple[int, int]


def sample_of(
    extracted: ExtractedSet,
    parameters: FitParameters | None = None,
    *,
    ridges: bool = True,
    window_px: float | None = None,
) -> ScoreSample:
    """Compare the impressions of a database with one another.

    Parameters
    ----------
    extracted : ExtractedSet
        The database and its templates, which must show their ridges.
    parameters : FitParameters, optional
        What share of the impostors to take.
    ridges : bool
        Whether the templates keep their ridges; else their minutiae alone are compared.
    window_px : float, optional
        Side in pixels at 500 dpi of the windows of which the probes are made (default: they are
        whole).

    Returns
    -------
    ScoreSample
        All genuine comparisons, and every so many of the others.
    """
    p = parameters or FitParameters()
    pairs = choose_pairs(extracted.dataset.impressions)
    templates = [
        one if one is None or ridges else replace(one, field=None)
        for one in (extraction.template for extraction in extracted.extractions)
    ]
    every = p.every_impostor
    prints = probes = [one and MATCHER.prepare(one) for one in templates]
    if window_px is not None:
        every = p.every_window_impostor
        rng = np.random.default_rng([SEED, round(window_px)])
        parts = (one and window(one, window_px, rng) for one in templates)
        probes = [one and MATCHER.prepare(one) for one in parts]
    room = max((len(one) for one in prints if one), default=0)
    scorers = tuple(evidence_scorer(room, _no_weights(refine)) for refine in (np.inf, -1.0))
    rows: list[NDArray[np.float64]] = []
    descriptors, strength, genuine, nothing, passed = [], [], [], [0, 0], 0
    for i, j, same in zip(pairs.probe, pairs.reference, pairs.genuine, strict=True):
        passed += not same
        if not same and passed % every:
            continue
        a, b = probes[i], prints[j]
        row = None if a is None or b is None else _features(a, b, scorers)
        if a is None or b is None or row is None:
            nothing[0 if same else 1] += 1
        else:
            rows.append(row[0])
            strength.append(row[1])
            descriptors.append(_descriptors_of(a, b))
            genuine.append(bool(same))
    shape = (len(rows), 2, HYPOTHESES, len(FEATURES))
    features = np.array(rows).reshape(shape)
    return ScoreSample(
        extracted.dataset.name,
        features[:, 1],
        features[:, 0],
        np.array(descriptors, np.float64).reshape(-1, 2),
        np.array(strength, np.float64),
        np.array(genuine, bool),
        (nothing[0], nothing[1]),
    )


def samples_of(
    sets: Sequence[ExtractedSet],
    parameters: FitParameters | None = None,
    *,
    workers: int | None = None,
) -> tuple[list[ScoreSample], list[ScoreSample], list[ScoreSample]]:
    """Compare the impressions of databases, as `fit_weights` takes the comparisons.

    Parameters
    ----------
    sets : sequence of ExtractedSet
        The databases and their templates, which must show their ridges.
    parameters : FitParameters, optional
        What share of the impostors to take, and the windows.
    workers : int, optional
        Processes to use (default: one a core).

    Returns
    -------
    tuple of lists of ScoreSample
        With ridges, on minutiae alone, and of windows against whole prints.
    """
    p = parameters or FitParameters()
    with ProcessPoolExecutor(workers) as pool:
        with_ridges, alone = (
            list(pool.map(partial(sample_of, parameters=p, ridges=ridges), sets))
            for ridges in (True, False)
        )
        windows = [
            sample
            for side in p.windows_px
            for sample in pool.map(partial(sample_of, parameters=p, window_px=side), sets)
        ]
    return with_ridges, alone, windows


def _no_weights(refine: float) -> ScoreWeights:
    """Return weights of 0; the ridges are compared where `refine` is negative."""
    standard = np.zeros((4, len(FEATURES)))
    standard[1] = 1.0
    model = ScoreModel(standard, 0.0, NO_PREFILTER, -1.0, refine, np.inf, np.array(NO_QUANTILES))
    return ScoreWeights((model,) * len(MODELS), {})


def _descriptors_of(probe: PreparedTemplate, reference: PreparedTemplate) -> tuple[int, int]:
    """Return the prefilter's score of two prints, and the minutiae of the smaller."""
    a, b = sorted((probe, reference), key=lambda side: side.key)
    return descriptor_similarity(a.bit_descriptors, b.bit_descriptors), min(len(a), len(b))


def _features(
    probe: PreparedTemplate,
    reference: PreparedTemplate,
    scorers: tuple[EvidenceScorer, ...],
) -> tuple[NDArray[np.float64], float] | None:
    """Return the features of two prints by each hypothesis, and the strength of the local matches.

    The features, shape (2, H, 12), are those of coarse alignment and of the refined one.
    """
    a, b = sorted((probe, reference), key=lambda side: side.key)
    if min(len(a), len(b)) < MIN_MINUTIAE:
        return None
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    aligner = aligner_of(a.points, b.points)
    sides = a.for_kernels(), b.for_kernels()
    found = np.full((2, HYPOTHESES, len(FEATURES)), np.nan)
    aligner.relax(similarity)
    for steps, scorer, rows in zip(
        (aligner.start_hypothesis, aligner.refine), scorers, found, strict=True
    ):
        for k, row in enumerate(rows[:LOCAL_HYPOTHESES]):
            if steps(k):
                scorer.score_alignment(*sides, aligner, similarity)
                row[:] = scorer.feature
    scorer, search = scorers[1], scorers[1].search
    ridges = [side.region.ridges is not None for side in (a, b)]
    model = scorer.choose_model(*ridges, min(a.region.area, b.region.area))
    by_ridges = 0
    if model == MODELS.index(SMALL_WITH_RIDGES):
        by_ridges = search.search(*sides, scorer.correlator)
    elif model == MODELS.index(WITH_RIDGES):
        by_ridges = search.search_candidates(*sides, aligner.relaxation, scorer.correlator)
    for k in range(by_ridges):
        if aligner.start_from(search.first[k], search.second[k]):
            scorer.score_alignment(*sides, aligner, similarity)
            found[1, LOCAL_HYPOTHESES + k] = scorer.feature
    if np.isnan(found[1, :, 0]).all():
        return None
    return found, aligner.relaxation.strength


def fit_weights(
    samples: Sequence[ScoreSample],
    alone: Sequence[ScoreSample],
    small: Sequence[ScoreSample],
    *,
    without: Collection[str] = (),
    command: str = "",
    parameters: FitParameters | None = None,
) -> ScoreWeights:
    """Learn the weights of the models, whose quantiles do not yet depend on what was compared.

    Parameters
    ----------
    samples : sequence of ScoreSample
        The databases, with ridges.
    alone : sequence of ScoreSample
        The same, of minutiae alone.
    small : sequence of ScoreSample
        The same, with ridges, of windows of the prints against whole ones: from them and the whole
        prints together the model of small prints is learned.
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
    genuine = np.concatenate([one.genuine for one in samples])
    provenance: dict[str, Any] = {
        "sets": [one.name for one in samples],
        "genuine": int(genuine.sum()),
        "impostors": int((~genuine).sum()),
        "version": __version__,
        "command": command,
    }
    first = fit_model(samples, without={*without, *SMALL_FEATURES}, parameters=p)
    second = fit_model(alone, without={*without, *RIDGE_FEATURES}, parameters=p)
    third = fit_model([*samples, *small], without=without, parameters=p)
    return ScoreWeights((first, second, second, third), provenance)


def fit_model(
    samples: Sequence[ScoreSample],
    *,
    without: Collection[str] = (),
    parameters: FitParameters | None = None,
) -> ScoreModel:
    """Learn one model; the parameters are those of `fit_weights`."""
    p = parameters or FitParameters()
    every = np.concatenate([one.features for one in samples])
    genuine = np.concatenate([one.genuine for one in samples])
    share = np.concatenate([_shares(one) for one in samples]) / len(samples)
    used = np.array([name not in without for name in FEATURES])
    x = every[np.arange(len(every)), (~np.isnan(every[..., 0])).argmax(axis=1)]
    for _ in range(p.turns):
        standard, bias = _fit(x, genuine, share, used, p)
        x = _chosen(every, standard, bias)[0]
    refined, every = every, np.concatenate([one.coarse for one in samples])
    coarse = _chosen(every, standard, bias, coarse=True)[1]
    passed = np.quantile(coarse[~genuine], [1.0 - p.refined, 1.0 - p.confident])
    refine, confident = _rounded(passed, p.digits).tolist()
    descriptors = np.concatenate([one.descriptors for one in samples])
    searched = ~np.isnan(refined[:, LOCAL_HYPOTHESES:, 0]).all(axis=1)
    total = _chosen(refined, standard, bias)[1]
    stands_out = total > np.quantile(total[~genuine], 1.0 - p.window_passed)
    passing = genuine & ((coarse > refine) | (searched & stands_out))
    prefilter = _prefilter(descriptors[passing], descriptors[~genuine], p)
    strength = np.sort(np.concatenate([one.strength for one in samples])[passing])
    lost = int(p.relaxation_loss * len(strength))
    weak = float(_rounded(strength[lost : lost + 1], p.digits)[0]) if len(strength) else -1.0
    no_quantiles = np.array(NO_QUANTILES)
    return ScoreModel(standard, bias, prefilter, weak, refine, confident, no_quantiles)


def _prefilter(
    passing: NDArray[np.float64], impostors: NDArray[np.float64], p: FitParameters
) -> tuple[float, float, float]:
    """Return the prefilter threshold: its base, its growth a minutia, and its limit.

    Both are rows as of `ScoreSample.descriptors`; of `passing`, all but a share must pass.
    """
    if not len(passing) or not len(impostors):
        return NO_PREFILTER
    lost = int(p.prefilter_loss * len(passing))
    found = []
    limit = p.prefilter_limit
    certain = passing[:, 0] >= limit
    for slope in np.linspace(0.0, p.steepest, p.slopes):
        left = np.where(certain, limit, passing[:, 0] - slope * passing[:, 1])
        base = float(np.sort(left)[lost])
        threshold = np.minimum(base + slope * impostors[:, 1], limit)
        found.append((np.count_nonzero(impostors[:, 0] < threshold), base, float(slope)))
    _, base, slope = max(found)
    base, slope = _rounded(np.array([base, slope]), p.digits).tolist()
    return base, slope, limit


def _fit(
    x: NDArray[np.float64],
    genuine: NDArray[np.bool_],
    share: NDArray[np.float64],
    used: NDArray[np.bool_],
    p: FitParameters,
) -> tuple[NDArray[np.float64], float]:
    """Return what is known of each feature, as `ScoreModel.standard` has it, and the bias."""
    means = [share[k] @ x[k] / share[k].sum() for k in (genuine, ~genuine)]
    middle = _rounded((means[0] + means[1]) / 2, p.digits)
    spread = _rounded(np.sqrt(share @ (x - middle) ** 2 / share.sum()), p.digits)
    spread[spread == 0.0] = 1.0  # of the ridges, where minutiae alone are compared
    z = np.column_stack([((x - middle) / spread)[:, used], np.ones(len(x))])
    found = _newton(z, genuine, share, p)
    weight = np.zeros(len(FEATURES))
    weight[used] = _rounded(found[:-1], p.digits)
    impostor_mean = _rounded(means[1], p.digits)
    return np.stack([middle, spread, weight, impostor_mean]), float(
        _rounded(found[-1:], p.digits)[0]
    )


def _chosen(
    every: NDArray[np.float64], standard: NDArray[np.float64], bias: float, *, coarse: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the features of the hypothesis of the greatest sum of each comparison, and the sum.

    In coarse alignment the ridges are not compared.
    """
    middle, spread, weight, impostor_mean = standard
    known = np.where(OF_RIDGES, impostor_mean, every) if coarse else every
    total = bias + (known - middle) / spread @ weight
    total = np.where(np.isnan(every[..., 0]), -np.inf, total)
    best = total.argmax(axis=1)
    rows = np.arange(len(every))
    return every[rows, best], total[rows, best]


def _greatest(
    every: NDArray[np.float64], model: ScoreModel, *, coarse: bool = False
) -> NDArray[np.float64]:
    """Return the greatest sum of each comparison; minus infinity where there is no hypothesis."""
    if not every.shape[1]:
        return np.full(len(every), -np.inf)
    return _chosen(every, model.standard, model.bias, coarse=coarse)[1]


def rates_of(samples: Sequence[ScoreSample], models: Sequence[ScoreModel]) -> dict[str, Any]:
    """Return the error rates of databases, each scored by its own model, in percent.

    Parameters
    ----------
    samples : sequence of ScoreSample
        The databases.
    models : sequence of ScoreModel
        One for each.

    Returns
    -------
    dict
        Under ``"sets"``, ``"mean"`` and ``"pooled"`` the EER and the FNMR at an FMR of 0.1 %.
    """
    scores = [_sums(*row) for row in zip(samples, models, strict=True)]
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
    sample: ScoreSample, model: ScoreModel
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sums of the genuine and the impostor comparisons; least where nothing was found.

    They are in the order of the similarities, which are those of ``log(1 + e^sum)``.
    """
    local, by_ridges = np.split(sample.features, [LOCAL_HYPOTHESES], axis=1)
    total = _greatest(local, model)
    coarse = _greatest(sample.coarse, model, coarse=True)
    total = np.where(coarse > model.refine_threshold, total, coarse)
    total = np.maximum(total, _greatest(by_ridges, model))
    total = np.where(
        np.isfinite(total), total, np.min(total, where=np.isfinite(total), initial=0.0)
    )
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
