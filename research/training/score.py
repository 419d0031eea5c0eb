"""The command that trains the weights of the default matcher's score."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.evaluation.databases.extraction import extract_datasets
from fpmatch.evaluation.run import load_datasets
from fpmatch.matching.score import WEIGHTS_FILE
from fpmatch.matching.score_model import FEATURES
from fpmatch.output import atomic_write_bytes, check_writable
from research.commands import PATH, Command, synthetic_folder, workers, write_json
from research.synthetic_sets import TRAINING_SEED, extract_synthetic_sets
from research.training.evidence_quantiles import fit_amounts
from research.training.score_fit import fit_model, fit_weights
from research.training.score_rates import rates_of
from research.training.score_samples import SampleParameters, sample_of, samples_of

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.matching.score_model import ScoreModel
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
@synthetic_folder
@workers
def command(
    into: Path,
    ablation: Path | None,
    checked: tuple[Path, ...],
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
    sets = extract_synthetic_sets(TRAINING_SEED, prints, workers)
    made, alone, small = samples_of(sets, workers=workers)
    weights = fit_weights(made, alone, small, command="python -m research train score")
    weights = fit_amounts(weights, sets, workers=workers)
    atomic_write_bytes(into, weights.as_json().encode(), public=True)
    click.echo(f"{into}: {weights.provenance['impostors']} impostor comparisons")
    if ablation:
        every = SampleParameters(every_impostor=1)
        others = extract_datasets(load_datasets(checked), workers=workers) if checked else []
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
