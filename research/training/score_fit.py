"""Fit of the weights of the default matcher's score to comparisons of known fingers.

It is logistic regression with five particulars.

- Impostor comparisons weigh more than genuine ones: the low false match rates matter, whereas a
  balanced fit depends on the range where the two kinds overlap most.
- A share of the genuine comparisons is taken for lost: nothing in common was found, and their
  features are those of impostors. Otherwise these few would dominate the fit.
- Every database, and in it every kind, has the same weight, whatever the number of comparisons.
- The prefilter rejects prints whose bit descriptors have a low score. Its threshold is a linear
  function of the smaller print's minutiae: of all functions that lose few genuine comparisons which
  coarse alignment would pass, the one that rejects the most impostors.
- Of the hypotheses of a comparison the one with the greatest sum counts. As it depends on the
  weights, choosing and fitting alternate.

Three models are fitted to the same prints: with their ridges; on minutiae alone; and, for small
prints, with ridges and with windows of the prints added. `research.training.evidence_quantiles`
conditions their sums on how much was compared.

The weights are found by Newton's method, the lost share by expectation and maximisation between
the steps.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.matching.pipeline.evidence import (
    FEATURES,
    MODELS,
    RIDGE_FEATURES,
    ScoreModel,
    ScoreWeights,
)
from research.training.rounding import round_significant
from research.training.score_samples import LOCAL_HYPOTHESES, NO_PREFILTER, NO_QUANTILES

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from research.training.score_samples import ScoreSample

OF_RIDGES: Final = np.array([name in RIDGE_FEATURES for name in FEATURES])
SMALL_FEATURES: Final = ("ridges by area",)  # used for small prints alone
ALWAYS: Final = -1000.0  # a sum that all hypotheses exceed: ridges of small prints always count


@dataclass(frozen=True, slots=True)
class FitParameters:
    """Set the fit.

    `impostor_weight`: weight of all impostor comparisons together against that of all genuine ones.
    `rounds`, `settled`: largest number of steps, and the change of the weights at which they end.
    `refined`, `confident`: shares of the impostor comparisons that exceed the refine threshold, and
    the confident threshold, in coarse alignment. `window_passed`: share of the impostor comparisons
    with a sum above which the prefilter should not reject a genuine comparison that is found by its
    ridges. `prefilter_loss`: share of the genuine comparisons that pass coarse alignment which the
    prefilter may reject. `prefilter_limit`: largest prefilter threshold: in prints of very many
    minutiae most are spurious, and the others agree in no more bits than in another print.
    `steepest`, `slopes`: largest growth of the prefilter threshold a minutia, and the number of
    slopes tried.
    """

    impostor_weight: float = 10.0
    lost_share: float = 0.03  # share of the genuine comparisons that are taken for lost
    ridge: float = 2e-5  # penalty on the squared weights of the standardised features
    rounds: int = 200
    settled: float = 1e-9
    longest_step: float = 2.0  # largest change of a weight in a step
    digits: int = 6  # significant digits kept
    refined: float = 0.25
    confident: float = 0.001
    window_passed: float = 0.01
    prefilter_loss: float = 0.0005
    relaxation_loss: float = 0.002  # share of the same whose local matches may be weak
    prefilter_limit: float = 30.0
    steepest: float = 3.0
    slopes: int = 61
    turns: int = 4  # how many times to choose hypotheses and to fit


def fit_weights(
    samples: Sequence[ScoreSample],
    alone: Sequence[ScoreSample],
    small: Sequence[ScoreSample],
    *,
    without: Collection[str] = (),
    command: str = "",
    parameters: FitParameters | None = None,
) -> ScoreWeights:
    """Fit the weights of all models, whose quantiles do not yet depend on what was compared."""
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
    third = replace(third, refine_threshold=ALWAYS)
    return ScoreWeights((first, second, third), provenance)


def fit_model(
    samples: Sequence[ScoreSample],
    *,
    without: Collection[str] = (),
    parameters: FitParameters | None = None,
) -> ScoreModel:
    """Fit one model; the parameters are those of `fit_weights`."""
    p = parameters or FitParameters()
    every = np.concatenate([one.features for one in samples])
    genuine = np.concatenate([one.genuine for one in samples])
    share = np.concatenate([_shares(one) for one in samples]) / len(samples)
    used = np.array([name not in without for name in FEATURES])
    x = every[np.arange(len(every)), (~np.isnan(every[..., 0])).argmax(axis=1)]
    for _ in range(p.turns):
        standard, bias = _fit(x, genuine, share, used, p)
        x = best_hypotheses(every, standard, bias)[0]
    refined, every = every, np.concatenate([one.coarse for one in samples])
    coarse = best_hypotheses(every, standard, bias, coarse=True)[1]
    passed = np.quantile(coarse[~genuine], [1.0 - p.refined, 1.0 - p.confident])
    refine, confident = round_significant(passed, p.digits).tolist()
    descriptors = np.concatenate([one.descriptors for one in samples])
    searched = ~np.isnan(refined[:, LOCAL_HYPOTHESES:, 0]).all(axis=1)
    total = best_hypotheses(refined, standard, bias)[1]
    exceeds = total > np.quantile(total[~genuine], 1.0 - p.window_passed)
    passing = genuine & ((coarse > refine) | (searched & exceeds))
    prefilter = _prefilter(descriptors[passing], descriptors[~genuine], p)
    strength = np.sort(np.concatenate([one.strength for one in samples])[passing])
    lost = int(p.relaxation_loss * len(strength))
    weak = (
        float(round_significant(strength[lost : lost + 1], p.digits)[0]) if len(strength) else -1.0
    )
    no_quantiles = np.array(NO_QUANTILES)
    return ScoreModel(standard, bias, prefilter, weak, refine, confident, no_quantiles)


def _prefilter(
    passing: NDArray[np.float64], impostors: NDArray[np.float64], p: FitParameters
) -> tuple[float, float, float]:
    """Return the prefilter threshold: its base, its growth a minutia, and its limit."""
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
    base, slope = round_significant(np.array([base, slope]), p.digits).tolist()
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
    middle = round_significant((means[0] + means[1]) / 2, p.digits)
    spread = round_significant(np.sqrt(share @ (x - middle) ** 2 / share.sum()), p.digits)
    spread[spread == 0.0] = 1.0  # of the ridges, where minutiae alone are compared
    z = np.column_stack([((x - middle) / spread)[:, used], np.ones(len(x))])
    found = _newton(z, genuine, share, p)
    weight = np.zeros(len(FEATURES))
    weight[used] = round_significant(found[:-1], p.digits)
    impostor_mean = round_significant(means[1], p.digits)
    return np.stack([middle, spread, weight, impostor_mean]), float(
        round_significant(found[-1:], p.digits)[0]
    )


def best_hypotheses(
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


def _shares(sample: ScoreSample) -> NDArray[np.float64]:
    """Return the weight of each comparison: together 1 a kind."""
    genuine = int(sample.genuine.sum())
    impostors = len(sample.genuine) - genuine
    return np.asarray(np.where(sample.genuine, 1.0 / max(genuine, 1), 1.0 / max(impostors, 1)))


def _newton(
    z: NDArray[np.float64], genuine: NDArray[np.bool_], share: NDArray[np.float64], p: FitParameters
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


def as_json(weights: ScoreWeights) -> str:
    """Return weights as the text of a JSON file, a list for each array of a model."""
    models = {
        name: {key: np.asarray(value).tolist() for key, value in asdict(model).items()}
        for name, model in zip(MODELS, weights.models, strict=True)
    }
    document = {"provenance": weights.provenance, "features": FEATURES, "models": models}
    return f"{json.dumps(document, indent=1)}\n"
