"""Targets of the matcher "triangles" on random point sets.

Under the patch model, at all 39 conditions:

- it recognises 99 % of 100 or more genuine pairs, and finds a match in at most 1 % of 20 or
  more independent pairs;
- a match takes no longer than scipy's triangulation of the same two sets where ρ is 0.9 or more,
  and no longer than 5 times that where ρ is 0.6;
- at n = 2m it is at least 20 times as fast as van Wamelen's matcher, in the geometric mean of the
  13 rows;
- where van Wamelen's matcher was run too, it recognises no fewer of the pairs that both tried.

Under the clutter model, where ρ is 0.9 or more, η at most 0.4, and n = 2m, it recognises 95 %,
and finds a match in at most 1 % of the independent pairs. A missing cell misses its target.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import click

from research.commands import PATH, Command
from research.points.conditions import PAPER_ROWS, Condition, conditions
from research.points.results import read_results
from research.points.summary import geometric_mean, speed_ups

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from research.points.results import BenchResults, PointCell

FEWEST_TRIALS: Final = 100
FEWEST_INDEPENDENT: Final = 20
LEAST_RECOGNISED: Final = {"patch": 0.99, "clutter": 0.95}
MOST_FALSE: Final = 0.01
MOST_TRIANGULATIONS: Final = {0.95: 1.0, 0.9: 1.0, 0.6: 5.0}
"""Largest time of a match, in scipy's triangulations of the same two sets, by ρ."""
LEAST_SPEED_UP: Final = 20.0
CLUTTER_LEAST_RHO: Final = 0.9
CLUTTER_MOST_ETA: Final = 0.4
CLUTTER_FACTOR: Final = 2


def missed_targets(results: BenchResults) -> list[str]:
    """Return a line for each measure of a full run that misses its target: cell, value, target."""
    missed = []
    for condition in conditions():
        if condition.model == "patch" or _is_easy_clutter(condition):
            missed += [f"triangles, {condition}: {miss}" for miss in _missed_at(results, condition)]
    return [*missed, *_missed_speed_up(results)]


def _is_easy_clutter(condition: Condition) -> bool:
    row = condition.parameters
    return (
        row.rho >= CLUTTER_LEAST_RHO
        and row.eta <= CLUTTER_MOST_ETA
        and condition.factor == CLUTTER_FACTOR
    )


def _missed_at(results: BenchResults, condition: Condition) -> Iterator[str]:
    cell = results.cell(condition, "triangles")
    if cell is None:
        yield "not run"
        return
    yield from _missed_answers(cell)
    if condition.model == "patch":
        yield from _missed_time(cell)
        baseline = results.cell(condition, "van-wamelen")
        if baseline is not None:
            yield from _missed_comparison(cell, baseline)


def _missed_answers(cell: PointCell) -> Iterator[str]:
    least = LEAST_RECOGNISED[cell.condition.model]
    if cell.trials < FEWEST_TRIALS or cell.independent_trials < FEWEST_INDEPENDENT:
        yield (
            f"{cell.trials} genuine and {cell.independent_trials} independent trials, "
            f"target at least {FEWEST_TRIALS} and {FEWEST_INDEPENDENT}"
        )
    if cell.true_positive_rate < least:
        yield f"recognised {cell.true_positive_rate:.3f}, target at least {least:g}"
    if cell.false_positive_rate > MOST_FALSE:
        yield f"false positives {cell.false_positive_rate:.3f}, target at most {MOST_FALSE:g}"


def _missed_time(cell: PointCell) -> Iterator[str]:
    most = MOST_TRIANGULATIONS[cell.condition.parameters.rho]
    share = cell.time_ms / cell.scipy_delaunay_ms
    if share > most:
        yield (
            f"time {cell.time_ms:.3f} ms, {share:.2f} times scipy's {cell.scipy_delaunay_ms:.3f} "
            f"ms, target at most {most:g} times"
        )


def _missed_comparison(ours: PointCell, baseline: PointCell) -> Iterator[str]:
    common = min(ours.trials, baseline.trials)
    right, theirs = (c.outcomes[:common].count("1") for c in (ours, baseline))
    if right < theirs:
        yield (
            f"recognised {right} of the {common} pairs that van-wamelen tried too, "
            f"target at least its {theirs}"
        )


def _missed_speed_up(results: BenchResults) -> Iterator[str]:
    missing = [
        str(condition)
        for condition in (Condition("patch", row, 2) for row in range(len(PAPER_ROWS)))
        if results.cell(condition, "van-wamelen") is None
    ]
    yield from (f"van-wamelen, {condition}: not run" for condition in missing)
    ratios = speed_ups(results, "patch")
    if ratios and geometric_mean(ratios) < LEAST_SPEED_UP:
        yield (
            "triangles over van-wamelen, patch, n = 2m: "
            f"{geometric_mean(ratios):.2f} times as fast, target at least {LEAST_SPEED_UP:g} times"
        )


@click.command(
    cls=Command,
    epilog="""\b
Example:
  python -m research check points docs/data/pointsets_bench.json
""",
)
@click.argument("results", metavar="FILE", type=PATH)
@click.pass_context
def command(context: click.Context, results: Path) -> None:
    """List the results on random point sets that miss their targets.

    FILE is what ``python -m research measure points --json`` wrote;
    `research.experiments.point_targets` defines the targets. The exit status is 1 if any is missed.
    """
    missed = missed_targets(read_results(results))
    click.echo("\n".join(missed) if missed else "no cell misses a target")
    context.exit(1 if missed else 0)
