"""The command that trains the weights of the default matcher's score."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.base.output import atomic_write_bytes, check_writable
from fpmatch.matching.pipeline.evidence import WEIGHTS_FILE
from research.commands import PATH, Command, synthetic_folder, workers
from research.databases import FINGERS, TRAINING_SEED, extract_synthetic_sets
from research.training.evidence_quantiles import fit_amounts
from research.training.score_fit import as_json, fit_weights
from research.training.score_samples import samples_of

if TYPE_CHECKING:
    from pathlib import Path


@click.command(cls=Command)
@click.option("--into", type=PATH, default=WEIGHTS_FILE, help="File to write.")
@click.option("--fingers", default=FINGERS, show_default=True, help="Of each synthetic database.")
@synthetic_folder
@workers
def command(into: Path, fingers: int, prints: Path | None, workers: int | None) -> None:
    """Train the weights of the default matcher's score on synthetic prints.

    Eight synthetic databases are made and all their impressions compared. The weights of the
    features are fitted to these comparisons; then the sums that impostor comparisons reach are
    fitted as functions of how much was compared. The same package writes the same file to the last
    bit.
    """
    into.parent.mkdir(parents=True, exist_ok=True)
    check_writable(into)
    sets = extract_synthetic_sets(TRAINING_SEED, prints, workers, fingers)
    made, alone, small = samples_of(sets, workers=workers)
    weights = fit_weights(made, alone, small, command="python -m research train score")
    weights = fit_amounts(weights, sets, workers=workers)
    atomic_write_bytes(into, as_json(weights).encode(), public=True)
    click.echo(f"{into}: {weights.provenance['impostors']} impostor comparisons")
