#!/usr/bin/env python3
"""Measure choices that the paper leaves open: rho and the area tolerance, on prints and point sets.

    .venv/bin/python research/benchmarks/paper_choices.py DIR... --json choices.json
    .venv/bin/python -m research tables points --choices choices.json

DIR are FVC-style databases of prints, compared as by `fpmatch evaluate --protocol extended`. On
random point sets, those of `fpmatch points bench` up to 200 points, it measures the area tolerance,
the decision rule, and an early exit of the default matcher. Times are processor times.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click
import numpy as np
import repository  # noqa: F401

from fpmatch.engine.engine import processes
from fpmatch.evaluation.databases.dataset import with_unique_names
from fpmatch.evaluation.databases.extraction import extract_datasets
from fpmatch.evaluation.run import evaluate_templates, load_datasets
from fpmatch.matching.matchers.paper import matcher_with
from research.commands import PATH, Command, folders, write_json
from research.experiments.point_choices import AREA_TOLERANCES, measure_points
from research.tables.points import count_accepted

if TYPE_CHECKING:
    from pathlib import Path


@click.command(cls=Command, help=__doc__.splitlines()[0])
@folders
@click.option("--json", "json_file", metavar="FILE", required=True, type=PATH, help="Results.")
@click.option("--trials", default=40, show_default=True, help="Pairs of point sets per condition.")
def main(folders: tuple[Path, ...], json_file: Path, trials: int) -> None:
    """Run the measurements and write them."""
    results: dict[str, Any] = {"prints": _prints(folders)}
    results |= measure_points(trials, lambda name: click.echo(name, err=True))
    write_json(json_file, results)


def _prints(folders: tuple[Path, ...]) -> list[dict[str, Any]]:
    """Return the numbers of pairs that match, by area tolerance and database."""
    rows = []
    with processes(1) as engine:
        sets = extract_datasets(with_unique_names(load_datasets(folders)), engine=engine)
        for area in AREA_TOLERANCES:
            matcher = matcher_with("paper", area_tolerance=area)
            report = evaluate_templates(sets, matcher=matcher, engine=engine)
            counted = [
                count_accepted(row.name, row.outcomes["similarity"], row.pairs.genuine)
                for row in report.sets
            ]
            times = np.concatenate([row.outcomes["cpu_us"] for row in report.sets])
            rows.append({"area_tolerance": area, "ms": float(times.mean()) / 1e3, "sets": counted})
            click.echo(f"prints, area tolerance {area:g}", err=True)
    return rows


if __name__ == "__main__":
    main()
