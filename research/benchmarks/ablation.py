#!/usr/bin/env python3
"""Measure what the features and the bounds of the default matcher's score are worth.

    .venv/bin/python research/benchmarks/ablation.py DIR... [--json FILE] [--prints FOLDER]

The pairs of the databases are compared once. Then the score is fitted again without each feature.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click
import numpy as np
import repository  # noqa: F401

from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.matching.constants import LEAST_SPREAD, LOG_10
from fpmatch.matching.matchers.unit_circle import MATCHER, pipeline_for
from fpmatch.matching.pipeline.evidence import (
    FEATURES,
    MODELS,
    RATES,
    RIDGE_FEATURES,
    ScoreWeights,
    load_weights,
)
from fpmatch.matching.reference.evidence import most_decades
from research.commands import (
    Command,
    folders,
    json_file,
    print_and_write,
    synthetic_folder,
    workers,
)
from research.databases import (
    TRAINING_SEED,
    extract_folders,
    extract_synthetic_sets,
    prints_of,
    without_ridges,
)
from research.tables import FORMS, format_features
from research.training.evidence_quantiles import (
    AmountParameters,
    AmountSample,
    fit_quantile,
    samples_of_parts,
)
from research.training.score_fit import fit_weights
from research.training.score_samples import SampleParameters, samples_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.matching.prints.prepared import PreparedTemplate

    Row = dict[str, Any]

EVERY_IMPOSTOR: Final = 12
PROBES: Final = 30  # of each kind and database, to measure what impostors reach
MESH_FEATURES: Final = FEATURES[1:4]
WITHOUT: Final = (
    *((name,) for name in FEATURES),
    MESH_FEATURES,
    RIDGE_FEATURES,
)
"""Features that are left out together."""
LEAST: Final = -100.0  # -ln(FMR) where nothing is paired


class Pairs(NamedTuple):
    """The comparisons of a database in one form.

    `genuine` (N,): whether both prints are of one finger. `model` (N,): of `MODELS`; -1 where there
    is no alignment. `features` (N, F) and `amounts` (N, 5) of the best alignment. `limit` (N,): the
    greatest decades of the FMR by the number of pairs and the ridges. `estimate` (N,): -ln(FMR).
    """

    genuine: NDArray[np.bool_]
    model: NDArray[np.intp]
    features: NDArray[np.float64]
    amounts: NDArray[np.float64]
    limit: NDArray[np.float64]
    estimate: NDArray[np.float64]


@click.command(cls=Command)
@folders
@synthetic_folder
@json_file
@workers
def main(
    folders: tuple[Path, ...], prints: Path | None, json_file: Path | None, workers: int | None
) -> None:
    """Measure what the features and the bounds of the score are worth.

    Each DIR is an FVC-style database. All its pairs are compared by the extended protocol, with the
    templates as they are extracted and on their minutiae alone. The features of their alignments
    are kept. Then the weights and the quantiles are fitted again without each feature, to the
    synthetic prints of ``python -m research train score``, one impostor comparison in twelve, and
    the kept alignments are scored by them; all features are fitted in the same way. In the last
    rows the weights are those of the package, without one of the bounds.

    Printed are, for each row, the mean EER / FMR1000 over the databases in percent, the mean d',
    and the largest loss of a database in percentage points, of the EER and of FMR1000.
    """
    measured = [
        {form: pairs_of(one, ridges=form == FORMS[0]) for form in FORMS}
        for one in extract_folders(folders, workers)
    ]
    sets = extract_synthetic_sets(TRAINING_SEED, prints, workers)
    few = SampleParameters(every_impostor=EVERY_IMPOSTOR, every_window_impostor=4 * EVERY_IMPOSTOR)
    samples = samples_of(sets, few, workers=workers)
    p = AmountParameters(probes=PROBES)
    parts = {
        name: samples_of_parts(load_weights(), sets, name, workers=workers, parameters=p)
        for name in MODELS
    }
    every = [scores_of(measured, fitted(samples, parts, ()))]
    names = ["all features, fitted anew"]
    for without in WITHOUT:
        every.append(scores_of(measured, fitted(samples, parts, without)))
        names.append(f"without {' and '.join(without)}")
    rows = rows_of(names, every, measured)
    kept = [
        ("all bounds, the package's weights", [_estimates(one) for one in measured]),
        ("without pairs held against chance", scores_of(measured, load_weights())),
        ("without any bound", scores_of(measured, load_weights(), bounded=False)),
    ]
    rows += rows_of([name for name, _ in kept], [scores for _, scores in kept], measured)
    print_and_write(format_features(rows), rows, json_file)


def pairs_of(extracted: Dataset, *, ridges: bool) -> Pairs:
    """Compare the impressions of a database with one another."""
    made = prints_of(extracted)
    prints = [MATCHER.prepare(one if ridges else without_ridges(one)) for _, one in made]
    rows = [
        (made[i][0].finger == made[j][0].finger, *_compared(prints[i], prints[j]))
        for i in range(len(prints))
        for j in range(i + 1, len(prints))
    ]
    return Pairs(*(np.array(column) for column in zip(*rows, strict=True)))


def _compared(
    probe: PreparedTemplate, reference: PreparedTemplate
) -> tuple[int, NDArray[np.float64], NDArray[np.float64], float, float]:
    """Return model, features, amounts, limit and estimate of a pair, as `Pairs` has them."""
    nothing = -1, np.zeros(len(FEATURES)), np.zeros(5), 0.0
    if not (len(probe) and len(reference)):
        return *nothing, LEAST
    compared = MATCHER.compare(probe, reference)
    if compared.detail is None:
        rejected = math.log(math.expm1(compared.similarity)) if compared.similarity else LEAST
        return *nothing, rejected
    e, weights = compared.detail, load_weights()
    scorer = pipeline_for(probe).scorer
    unusual = e.ridges - MATCHER.parameters.usual_correlation
    return (
        weights.models.index(weights.model_of(probe, reference)),
        np.array(scorer.feature),
        np.array(scorer.term),
        most_decades(e.pairs, unusual, e.cells),
        e.minus_log_fmr,
    )


def fitted(
    samples: tuple[list[Any], list[Any], list[Any]],
    parts: dict[str, list[AmountSample]],
    without: Sequence[str],
) -> ScoreWeights:
    """Return weights and quantiles that are fitted without some features."""
    weights = fit_weights(*samples, without=without)
    models = []
    for name, model in zip(MODELS, weights.models, strict=True):
        summed = [replace(one, sums=model.sums(one.features)) for one in parts[name]]
        quantiles = np.stack([fit_quantile(summed, rate) for rate in RATES])
        models.append(replace(model, quantiles=quantiles))
    return replace(weights, models=tuple(models))


def scores_of(
    measured: Sequence[dict[str, Pairs]], weights: ScoreWeights, *, bounded: bool = True
) -> list[dict[str, NDArray[np.float64]]]:
    """Return -ln(FMR) of all comparisons by other weights, pairs not held against chance."""
    return [
        {form: _score(pairs, weights, bounded=bounded) for form, pairs in one.items()}
        for one in measured
    ]


def _estimates(measured: dict[str, Pairs]) -> dict[str, NDArray[np.float64]]:
    return {form: pairs.estimate for form, pairs in measured.items()}


def _score(pairs: Pairs, weights: ScoreWeights, *, bounded: bool) -> NDArray[np.float64]:
    scores = pairs.estimate.copy()
    for number, model in enumerate(weights.models):
        own = pairs.model == number
        low, high = model.quantiles @ pairs.amounts[own].T
        decades = 2.0 + (model.sums(pairs.features[own]) - low) / np.maximum(
            high - low, LEAST_SPREAD
        )
        scores[own] = LOG_10 * (np.minimum(decades, pairs.limit[own]) if bounded else decades)
    return scores


def rows_of(
    names: Sequence[str],
    every: Sequence[Sequence[dict[str, NDArray[np.float64]]]],
    measured: Sequence[dict[str, Pairs]],
) -> list[Row]:
    """Return a row for each set of scores; the losses are those against the first."""
    rows: list[Row] = []
    base: dict[str, list[Any]] = {}
    for name, scores in zip(names, every, strict=True):
        row: Row = {"name": name}
        for form in FORMS:
            genuine = [one[form].genuine for one in measured]
            rates = [
                error_rates(one[form][same], one[form][~same])
                for one, same in zip(scores, genuine, strict=True)
            ]
            before = base.setdefault(form, rates)
            row[form] = {
                "eer": float(np.mean([one.eer for one in rates])),
                "fmr1000": float(np.mean([one.fmr1000 for one in rates])),
                "d_prime": float(np.mean([one.d_prime for one in rates])),
                "lost": {
                    rate: max(
                        getattr(after, rate) - getattr(then, rate)
                        for after, then in zip(rates, before, strict=True)
                    )
                    for rate in ("eer", "fmr1000")
                },
            }
        rows.append(row)
    return rows


if __name__ == "__main__":
    main()
