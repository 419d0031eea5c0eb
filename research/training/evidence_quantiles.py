"""Quantiles of the sums of impostor comparisons, as functions of the amount of evidence.

Whole prints, windows and fragments of prints, and prints with few of their minutiae, with ridges
and without, are compared with whole prints of other fingers. The sums that 1 % and 0.1 % of them
reach are fitted as linear functions of the amount of evidence (see `pipeline.evidence`), by
quantile regression in which every kind of part has the same weight. Then the same parts are
compared with other impressions of their fingers: the -ln(FMR) that half of these comparisons reach
is fitted as a function of the minutiae and the area of the smaller print. It determines how much
evidence a decision needs.

References
----------
Koenker, Bassett, "Regression quantiles", Econometrica 46 (1978). The corner of the loss is rounded
(Zheng, "Gradient descent algorithms for quantile regression with smooth approximation", 2011), so
that Newton's method finds the minimum.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.matching.matchers.unit_circle import MATCHER, index_neighbours, view_of
from fpmatch.matching.parameters import USUAL
from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from fpmatch.matching.pipeline.evidence import (
    AMOUNTS,
    MINUTIAE_ALONE,
    MODELS,
    RATES,
    SMALL_WITH_RIDGES,
    WITH_RIDGES,
    amount_terms,
)
from research.databases import prints_of, without_ridges
from research.partial_templates import fragment, thinned, window
from research.training.rounding import round_significant

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.matching.pipeline.evidence import ScoreWeights
    from fpmatch.matching.prints.prepared import PreparedTemplate
    from fpmatch.templates.minutiae import Template

    Compared = tuple[float, NDArray[np.float64], NDArray[np.float64]]

SEED: Final = 17
HAVE_RIDGES: Final = {WITH_RIDGES: True, MINUTIAE_ALONE: False, SMALL_WITH_RIDGES: True}
"""Whether the prints and their parts have ridges, by model."""


@dataclass(frozen=True, slots=True)
class AmountParameters:
    """Set the comparisons and the fit.

    `fragments`: numbers of minutiae of the fragments, and of prints with few of their minutiae.
    `windows_px`: sides of the windows in pixels at 500 dpi. `probes`, `references`, `mates`: prints
    or parts of each kind that are drawn from a database, and the whole prints of other fingers, and
    of the same finger, that each is compared with. `whole_weight`, `thinned_weight`: weight of the
    comparisons of whole prints, and of prints with few of their minutiae, against those of one
    other kind of part. The minutiae of the latter are sparser than in any image. `rounding`: sum
    over which the corner of the loss is rounded. `rounds`, `settled`: largest number of Newton's
    steps, and the change of the loss at which they end. `digits`: significant digits kept.
    """

    fragments: tuple[int, ...] = (3, 4, 5, 6, 8, 10, 12)
    windows_px: tuple[int, ...] = (48, 64, 96, 128, 160, 200)
    probes: int = 80
    references: int = 24
    mates: int = 6
    whole_weight: float = 5.0
    thinned_weight: float = 0.5
    rounding: float = 0.15
    rounds: int = 200
    settled: float = 1e-13
    digits: int = 6


@dataclass(frozen=True, slots=True, eq=False)
class AmountSample:
    """Comparisons of one kind: their weighted sums, and how much was compared.

    `sums` (N,): weighted sums of the features; of genuine comparisons -ln(FMR). `features` (N, F):
    those of the best alignment. `amounts` (N, 5): the terms of
    `fpmatch.matching.pipeline.evidence.AMOUNTS`. `weight`: weight of all of them together.
    """

    sums: NDArray[np.float64]
    features: NDArray[np.float64]
    amounts: NDArray[np.float64]
    weight: float


def fit_amounts(
    weights: ScoreWeights,
    sets: Sequence[Dataset],
    *,
    workers: int | None = None,
    parameters: AmountParameters | None = None,
) -> ScoreWeights:
    """Return the weights with quantiles of impostor, and medians of genuine comparisons."""
    p = parameters or AmountParameters()

    def samples(name: str, *, genuine: bool) -> list[AmountSample]:
        return samples_of_parts(weights, sets, name, genuine=genuine, workers=workers, parameters=p)

    models = []
    for name, model in zip(MODELS, weights.models, strict=True):
        impostors = samples(name, genuine=False)
        quantiles = [fit_quantile(impostors, rate, p) for rate in RATES]
        models.append(replace(model, quantiles=np.stack(quantiles)))
    weights = replace(weights, models=tuple(models))
    models = [
        replace(model, genuine_median=fit_quantile(samples(name, genuine=True), 0.5, p))
        for name, model in zip(MODELS, weights.models, strict=True)
    ]
    return replace(weights, models=tuple(models))


def samples_of_parts(
    weights: ScoreWeights,
    sets: Sequence[Dataset],
    model: str,
    *,
    genuine: bool = False,
    workers: int | None = None,
    parameters: AmountParameters | None = None,
) -> list[AmountSample]:
    """Return the comparisons of prints and parts of prints that a model scores, by kind of part."""
    task = partial(
        amount_samples,
        weights=weights,
        model=model,
        ridges=HAVE_RIDGES[model],
        genuine=genuine,
        parameters=parameters,
    )
    with ProcessPoolExecutor(workers) as pool:
        rows = list(pool.map(task, sets, range(SEED, SEED + len(sets))))
    return [one for row in rows for one in row]


def amount_samples(
    extracted: Dataset,
    seed: int,
    *,
    weights: ScoreWeights,
    model: str,
    ridges: bool,
    genuine: bool = False,
    parameters: AmountParameters | None = None,
) -> list[AmountSample]:
    """Compare prints and parts of prints of a database with whole prints; a sample a kind of part.

    Impostor comparisons in which nothing is paired are left out: they have no sum, so that the
    shares of those with a sum are overestimated rather than underestimated. With `genuine`, parts
    are compared with other impressions of their fingers; the amount is then that of the smaller
    print.
    """
    p = parameters or AmountParameters()
    prints = [row for row in prints_of(extracted) if len(row[1].minutiae)]
    whole, finger = [template for _, template in prints], [shown.finger for shown, _ in prints]
    if not ridges:
        whole = [without_ridges(one) for one in whole]
    prepared = [MATCHER.prepare(one) for one in whole]
    room = max((len(one) for one in prepared), default=0)
    pipeline = Pipeline(max(room, 1), USUAL, weights)
    compared = _genuine if genuine else _impostor
    samples = []
    for number, (make, weight) in enumerate(_kinds(p)):
        rng = np.random.default_rng([seed, number])
        rows = []
        for k in rng.integers(len(whole), size=p.probes if whole else 0).tolist():
            probe = MATCHER.prepare(make(whole[k], rng))
            others = [
                j for j in range(len(whole)) if j != k and (finger[j] == finger[k]) is genuine
            ]
            count = p.mates if genuine else p.references
            for j in rng.choice(others, count).tolist() if others else ():
                if weights.model_of(probe, prepared[j]) is weights.models[MODELS.index(model)]:
                    rows += compared(probe, prepared[j], pipeline, weights)
        if rows:
            sums, features, amounts = (np.array(column) for column in zip(*rows, strict=True))
            samples.append(AmountSample(sums, features, amounts, weight))
    return samples


def _kinds(
    p: AmountParameters,
) -> list[tuple[Callable[[Template, np.random.Generator], Template], float]]:
    """Return the function that cuts each kind of part of a print, and the weight of the kind."""
    return [
        (lambda template, _: template, p.whole_weight),
        *((_part(fragment, size), 1.0) for size in p.fragments),
        *((_part(thinned, size), p.thinned_weight) for size in p.fragments),
        *((_part(window, side), 1.0) for side in p.windows_px),
    ]


def _part(
    cut: Callable[[Template, int, np.random.Generator], Template], size: int
) -> Callable[[Template, np.random.Generator], Template]:
    return lambda template, rng: cut(template, size, rng)


def _impostor(
    probe: PreparedTemplate,
    reference: PreparedTemplate,
    pipeline: Pipeline,
    weights: ScoreWeights,
) -> list[Compared]:
    """Return sum and features of the best alignment, and how much was compared."""
    if _aligned(probe, reference, pipeline) is None:
        return []
    features = np.array(pipeline.scorer.feature)
    sums = weights.model_of(probe, reference).sums(features)
    return [(float(sums), features, np.array(pipeline.scorer.term))]


def _genuine(
    probe: PreparedTemplate, reference: PreparedTemplate, pipeline: Pipeline, _: ScoreWeights
) -> list[Compared]:
    """Return -ln(FMR), 0 where nothing was found, and how much there was to compare."""
    if not (len(probe) and len(reference)):
        return []
    found = _aligned(probe, reference, pipeline)
    sides = probe, reference
    area = min(side.region.inside * side.region.step**2 for side in sides)
    amounts = amount_terms(min(map(len, sides)), area)
    return [(0.0 if found is None else max(found, 0.0), np.empty(0), amounts)]


def _aligned(
    probe: PreparedTemplate, reference: PreparedTemplate, pipeline: Pipeline
) -> float | None:
    if not len(probe):
        return None
    pipeline.load(view_of(probe))
    index_neighbours(pipeline, probe)
    estimate: float = pipeline.match(view_of(reference), reference.key < probe.key)
    return estimate if pipeline.best >= 0 else None


def fit_quantile(
    samples: Sequence[AmountSample], rate: float, parameters: AmountParameters | None = None
) -> NDArray[np.float64]:
    """Fit the sum that a share of the comparisons reach, given the amount of evidence."""
    p = parameters or AmountParameters()
    x = np.concatenate([one.amounts for one in samples])
    y = np.concatenate([one.sums for one in samples])
    share = np.concatenate([np.full(len(one.sums), one.weight / len(one.sums)) for one in samples])
    share /= share.sum()
    below = 1.0 - rate
    h = p.rounding

    def loss(found: NDArray[np.float64]) -> float:
        left = y - x @ found
        return float(share @ (below * left + h * np.logaddexp(0.0, -left / h)))

    found = np.zeros(len(AMOUNTS))
    found[0] = np.quantile(y, below)
    least = loss(found)
    for _ in range(p.rounds):
        under = 1.0 / (1.0 + np.exp(np.clip((y - x @ found) / h, -50.0, 50.0)))
        slope = -x.T @ (share * (below - under))
        curve = (x * (share * under * (1.0 - under) / h)[:, None]).T @ x
        step = np.linalg.solve(curve + 1e-9 * np.eye(len(found)), slope)
        length = 1.0
        while loss(found - length * step) > least and length > p.settled:
            length /= 2.0
        found = found - length * step
        before, least = least, loss(found)
        if before - least < p.settled:
            break
    return round_significant(found, p.digits)
