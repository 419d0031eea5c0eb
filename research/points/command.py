"""``python -m research measure points``: the paper's experiment on random point sets."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from fpmatch.lab.plots.style import check_plot
from research.commands import PATH, Command, json_file
from research.points.bench import check_same_settings, describe_settings, run_bench
from research.points.conditions import conditions
from research.points.matchers import MATCHER_NAMES, is_installed, matcher_named
from research.points.plot import save_bench_plot
from research.points.random_sets import POINT_MODELS
from research.points.results import BenchResults, read_results, write_results
from research.points.table import format_bench
from research.points.trials import QUICK_LARGEST_M, QUICK_PLAN, TrialPlan

if TYPE_CHECKING:
    from pathlib import Path

    from research.points.matchers import BenchMatcher
    from research.points.random_sets import PointModel

_FROM_1 = click.IntRange(1)


@click.command(
    cls=Command,
    epilog="""\b
Matchers:
  triangles    the default of `fpmatch points`
  paper        the paper's method, which matches where more than a share rho of P is paired
  van-wamelen  the baseline of the paper, given the true rho and lambda
  astroalign   the Python package, where it is installed

\b
Models of where P's partners lie in Q:
  patch        in a part of Q as large as P, so that neighbours stay neighbours
  clutter      anywhere in Q, with other points between them

\b
Examples:
  python -m research measure points --quick
  python -m research measure points --json bench.json --plot bench.png
  python -m research measure points --json bench.json --resume --matcher astroalign
""",
)
@click.option("--trials", type=_FROM_1, help="Pairs of sets a cell.  [default: 100]")
@click.option(
    "--independent-trials",
    type=_FROM_1,
    help="Independent pairs a cell, on which a search takes longest.  [default: as --trials]",
)
@click.option(
    "--matcher",
    "matchers",
    multiple=True,
    type=click.Choice(MATCHER_NAMES),
    help="Matcher to try (repeatable).  [default: all]",
)
@click.option(
    "--model",
    "models",
    multiple=True,
    type=click.Choice(POINT_MODELS),
    help="Model of the experiment (repeatable).  [default: both]",
)
@click.option("--seed", type=click.IntRange(0), default=0, help="Seed of the sets.  [default: 0]")
@click.option(
    "--budget",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="Time after which matchers other than triangles try no more pairs of a kind in a cell, "
    "after five at least.  [default: 20]",
)
@click.option("--quick", is_flag=True, help="A run of a minute: rows up to m = 100, few pairs.")
@json_file
@click.option("--resume", is_flag=True, help="Continue the file of --json.")
@click.option("--plot", metavar="FILE", type=PATH, help="Plot time against n: .png, .svg or .pdf.")
def command(
    trials: int | None,
    independent_trials: int | None,
    matchers: tuple[str, ...],
    models: tuple[PointModel, ...],
    seed: int,
    budget: float | None,
    quick: bool,
    json_file: Path | None,
    resume: bool,
    plot: Path | None,
) -> None:
    """Repeat the paper's experiment on random point sets.

    For each of the 13 rows of the paper's tables, and n = 2m, 4m and 8m, every matcher is tried on
    pairs of random sets: on pairs that have points in common, for its time and how often it finds
    the true transform, and on independent pairs, for its false positives. The results are printed
    beside the paper's own times.

    Times are processor times of one thread. A full run takes an hour or more; --json with
    --resume continues it after an interruption.
    """
    if resume and json_file is None:
        raise click.UsageError("--resume needs the file of --json")
    if plot is not None:
        check_plot(plot)
    if budget is not None and not math.isfinite(budget):
        raise click.BadParameter(f"{budget} is no number of seconds", param_hint="'--budget'")
    given = {"trials": trials, "independent_trials": independent_trials, "budget_s": budget}
    changed: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    plan = replace(QUICK_PLAN if quick else TrialPlan(), seed=seed, **changed)
    results = _results(plan, json_file if resume else None)
    where = conditions(models or POINT_MODELS, QUICK_LARGEST_M if quick else None)

    def keep(_: object) -> None:
        if json_file is not None:
            write_results(json_file, results)

    def show(cell: str) -> None:
        click.echo(cell, err=True)

    run_bench(results, where, _installed(matchers), plan, started=show, finished=keep)
    click.echo(format_bench(results))
    if plot is not None:
        save_bench_plot(plot, results)


def _installed(names: tuple[str, ...]) -> list[BenchMatcher]:
    """Return the matchers of these names; of all, with a note, those that are installed."""
    for name in () if names else MATCHER_NAMES:
        if not is_installed(name):
            click.echo(f"{name} is left out: pip install 'fpmatch[bench]'", err=True)
    chosen = dict.fromkeys(names) or filter(is_installed, MATCHER_NAMES)
    return [matcher_named(name) for name in chosen]


def _results(plan: TrialPlan, old: Path | None) -> BenchResults:
    """Return the results to add to, of the file `old` where it exists."""
    settings = describe_settings(plan)
    if old is None or not old.exists():
        return BenchResults(settings)
    results = read_results(old)
    check_same_settings(str(old), results.settings, settings)
    return results
