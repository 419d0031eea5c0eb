"""The command that trains the weights of the default matcher's score, and their error rates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click
import numpy as np

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.matching.pipeline.evidence import WEIGHTS_FILE
from fpmatch.matching.pipeline.score_model import FEATURES
from research.commands import PATH, Command, synthetic_folder, workers, write_json
from research.databases import FINGERS, TRAINING_SEED, extract_folders, extract_synthetic_sets
from research.training.evidence_quantiles import fit_amounts
from research.training.score_fit import best_hypotheses, fit_model, fit_weights
from research.training.score_samples import (
    LOCAL_HYPOTHESES,
    SampleParameters,
    sample_of,
    samples_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.matching.pipeline.score_model import ScoreModel
    from research.training.score_samples import ScoreSample


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research train score --ablation ablation.json --check fvc/fvc2002/DB1_B
""",
)
@click.option("--into", type=PATH, default=WEIGHTS_FILE, help="File to write.")
@click.option("--ablation", type=PATH, help="Write the ablation of features to this file.")
@click.option(
    "--check", "checked", type=PATH, multiple=True, help="An FVC-style database (repeatable)."
)
@click.option("--fingers", default=FINGERS, show_default=True, help="Of each synthetic database.")
@synthetic_folder
@workers
def command(
    into: Path,
    ablation: Path | None,
    checked: tuple[Path, ...],
    fingers: int,
    prints: Path | None,
    workers: int | None,
) -> None:
    """Train the weights of the default matcher's score on synthetic prints.

    Eight synthetic databases are made and all their impressions compared. The weights of the
    features are fitted to these comparisons; then the sums that impostor comparisons reach are
    fitted as functions of how much was compared. The same package writes the same file to the last
    bit.

    --ablation measures the error rates with all features and without each: on every synthetic
    database, trained on the others, and on the databases of --check, trained on the synthetic ones
    and, for comparison, on the others of --check.
    """
    into.parent.mkdir(parents=True, exist_ok=True)
    for target in filter(None, (into, ablation)):
        check_writable(target)
    sets = extract_synthetic_sets(TRAINING_SEED, prints, workers, fingers)
    made, alone, small = samples_of(sets, workers=workers)
    weights = fit_weights(made, alone, small, command="python -m research train score")
    weights = fit_amounts(weights, sets, workers=workers)
    atomic_write_bytes(into, weights.as_json().encode(), public=True)
    click.echo(f"{into}: {weights.provenance['impostors']} impostor comparisons")
    if ablation:
        every = SampleParameters(every_impostor=1)
        others = extract_folders(checked, workers)
        write_json(ablation, ablate(made, [sample_of(one, every) for one in others]))
        click.echo(ablation)


def ablate(made: list[ScoreSample], checked: list[ScoreSample]) -> dict[str, object]:
    """Return the error rates with all features, and without each."""
    table: dict[str, object] = {}
    for without in ((), *((name,) for name in FEATURES)):
        row = {"synthetic": rates_of(made, _cross_validated(made, without))}
        if checked:
            model = fit_model(made, without=without)
            row["checked"] = rates_of(checked, [model] * len(checked))
        if len(checked) > 1:
            models = _cross_validated(checked, without)
            row["checked, learned from the others"] = rates_of(checked, models)
        table[f"without {without[0]}" if without else "all"] = row
    return table


def _cross_validated(samples: list[ScoreSample], without: tuple[str, ...]) -> list[ScoreModel]:
    """Return for each database the model that is trained on the others."""
    return [fit_model(samples[:k] + samples[k + 1 :], without=without) for k in range(len(samples))]


def rates_of(samples: Sequence[ScoreSample], models: Sequence[ScoreModel]) -> dict[str, Any]:
    """Return EER and FNMR at an FMR of 0.1 % of databases, each by its own model, in percent."""
    scores = [_sums(*row) for row in zip(samples, models, strict=True)]
    sets = [_rates(*row) for row in scores]
    mean = {name: round(float(np.mean([one[name] for one in sets])), 3) for name in sets[0]}
    pooled = _rates(*(np.concatenate(kind) for kind in zip(*scores, strict=True)))
    named = {one.name: row for one, row in zip(samples, sets, strict=True)}
    return {"mean": mean, "pooled": pooled, "sets": named}


def _greatest(
    every: NDArray[np.float64], model: ScoreModel, *, coarse: bool = False
) -> NDArray[np.float64]:
    """Return the greatest sum of each comparison; minus infinity where there is no hypothesis."""
    if not every.shape[1]:
        return np.full(len(every), -np.inf)
    return best_hypotheses(every, model.standard, model.bias, coarse=coarse)[1]


def _sums(
    sample: ScoreSample, model: ScoreModel
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sums of genuine and impostor comparisons, as their similarities are ordered."""
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
