"""The command ``check calibration``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fpmatch.evaluation.databases.dataset import with_unique_names
from fpmatch.evaluation.run import evaluate, load_datasets
from fpmatch.matching.matchers import DEFAULT_MATCHER
from research.all_pairs import impostors_among
from research.commands import Command, folders, json_file, synthetic_folder, workers, write_json
from research.experiments.calibration_check import (
    CalibrationCheck,
    check_calibration,
    check_impostors,
    format_calibration_checks,
    together,
)
from research.synthetic_sets import TEST_SEED, extract_synthetic_sets

if TYPE_CHECKING:
    from pathlib import Path


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check calibration fvc/*/* --synthetic --json calibration.json
""",
)
@folders
@click.option("--matcher", default=DEFAULT_MATCHER, show_default=True)
@click.option("--synthetic", is_flag=True, help="Also compare eight synthetic databases.")
@synthetic_folder
@json_file
@workers
@click.pass_context
def command(
    context: click.Context,
    folders: tuple[Path, ...],
    matcher: str,
    synthetic: bool,
    prints: Path | None,
    json_file: Path | None,
    workers: int | None,
) -> None:
    """Compare the false match rates at calibrated scores with the stated ones.

    All impressions of different fingers within each FVC-style database DIR are compared. For the
    scores 20, 30 and 40 the share of comparisons that reach them stands beside the stated 1 %,
    0.1 % and 0.01 %. --synthetic adds a row of 1.8 million comparisons by the default matcher, of
    eight synthetic databases that nothing was trained on, and a row of everything together. The
    exit status is 0 if the last row lies within a factor of two of the stated rates, 1 otherwise.
    """
    report = evaluate(with_unique_names(load_datasets(folders)), matcher=matcher, workers=workers)
    checks = check_calibration(report)
    if synthetic:
        checks.append(_check_synthetic(prints, workers))
        checks.append(together("together", checks[-2:]))
    click.echo(format_calibration_checks(checks))
    if json_file:
        sets = [check.as_json() for check in checks]
        write_json(json_file, {"matcher": report.matcher, "sets": sets})
    context.exit(0 if all(checks[-1].kept) else 1)


def _check_synthetic(prints: Path | None, workers: int | None) -> CalibrationCheck:
    """Compare all impressions of synthetic databases with one another."""
    sets = extract_synthetic_sets(TEST_SEED, prints, workers)
    name = f"synthetic, seeds {TEST_SEED} to {TEST_SEED + len(sets) - 1}"
    return check_impostors(impostors_among(sets, name, workers), DEFAULT_MATCHER)
