"""`fpmatch points bench`: the paper's experiment on random point sets."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import ProgressBars, say_note, show
from fpmatch.cli.options import Name, file_option
from fpmatch.gallery.cli.options import FROM_0, FROM_1

if TYPE_CHECKING:
    from pathlib import Path

    from fpmatch.lab.points.bench.matchers import BenchMatcher
    from fpmatch.lab.points.bench.results import BenchResults
    from fpmatch.lab.points.bench.trials import TrialPlan
    from fpmatch.lab.points.random_sets import PointModel

_MATCHERS: Final = ("triangles", "paper", "van-wamelen", "astroalign")
_MODELS: Final[tuple[PointModel, ...]] = ("patch", "clutter")
_LABEL_WIDTH: Final = 48


@click.command(
    "bench",
    cls=Command,
    details="""\b
Matchers:
  triangles    the default of `fpmatch points match`
  paper        the paper's method, which matches where more than a share rho of P is paired
  van-wamelen  the baseline of the paper, given the true rho and lambda
  astroalign   the Python package, where it is installed

\b
Models of where P's partners lie in Q:
  patch        in a part of Q as large as P, so that neighbours stay neighbours
  clutter      anywhere in Q, with other points between them
""",
    epilog="""\b
Examples:
  fpmatch points bench --quick
  fpmatch points bench --json bench.json --plot bench.png
  fpmatch points bench --json bench.json --resume --matcher astroalign
""",
)
@click.option("--trials", type=FROM_1, help="Pairs of sets a cell.  [default: 100]")
@click.option(
    "--independent-trials",
    type=FROM_1,
    hidden=True,
    help="Independent pairs a cell, on which a search takes longest.  [default: as --trials]",
)
@click.option(
    "--matcher",
    "matchers",
    multiple=True,
    type=Name(_MATCHERS),
    help="Matcher to try (repeatable).  [default: all]",
)
@click.option(
    "--model",
    "models",
    multiple=True,
    type=Name(_MODELS),
    hidden=True,
    help="Model of the experiment (repeatable).  [default: both]",
)
@click.option("--seed", type=FROM_0, default=0, help="Seed of the sets.")
@click.option(
    "--budget",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    hidden=True,
    help="Time after which matchers other than triangles try no more pairs of a kind in a cell, "
    "after five at least.  [default: 20]",
)
@click.option("--quick", is_flag=True, help="A run of a minute: rows up to m = 100, few pairs.")
@click.option(
    "--workers",
    type=FROM_1,
    default=1,
    help="Processes to use. More slow each other down: only times of one cell are comparable.",
)
@file_option(
    "--json", "json_file", metavar="FILE", help="Write the results as JSON, after each cell."
)
@click.option("--resume", is_flag=True, help="Continue the file of --json.")
@file_option("--plot", metavar="FILE", help="Plot time against n into a .png, .svg or .pdf.")
@click.option("--markdown", is_flag=True, hidden=True, help="Print the tables in Markdown.")
def points_bench(
    trials: int | None,
    independent_trials: int | None,
    matchers: tuple[str, ...],
    models: tuple[PointModel, ...],
    seed: int,
    budget: float | None,
    quick: bool,
    workers: int,
    json_file: Path | None,
    resume: bool,
    plot: Path | None,
    markdown: bool,
) -> None:
    """Repeat the paper's experiment on random point sets.

    For each of the 13 rows of the paper's tables, and n = 2m, 4m and 8m, every matcher is tried on
    pairs of random sets: on pairs that have points in common, for its time and how often it finds
    the true transform, and on independent pairs, for its false positives. The results are printed
    beside the paper's own times.

    Times are processor times of one thread. A full run takes an hour or more; --json with
    --resume continues it after an interruption.
    """
    from fpmatch.base.output import check_writable
    from fpmatch.lab.plots.style import check_plot
    from fpmatch.lab.points.bench.bench import run_bench
    from fpmatch.lab.points.bench.conditions import conditions
    from fpmatch.lab.points.bench.plot import save_bench_plot
    from fpmatch.lab.points.bench.results import write_results
    from fpmatch.lab.points.bench.table import format_bench, format_bench_markdown
    from fpmatch.lab.points.bench.trials import QUICK_LARGEST_M, QUICK_PLAN, TrialPlan

    if resume and json_file is None:
        raise click.UsageError("--resume needs the file of --json")
    if json_file is not None:
        check_writable(json_file)
    if plot is not None:
        check_plot(plot)
    if budget is not None and not math.isfinite(budget):
        raise click.BadParameter(f"{budget} is no number of seconds", param_hint="'--budget'")
    given = {"trials": trials, "independent_trials": independent_trials, "budget_s": budget}
    changed: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    plan = replace(QUICK_PLAN if quick else TrialPlan(), seed=seed, **changed)
    results = _results(plan, workers, json_file if resume else None)
    chosen = _installed(matchers)
    where = conditions(models or _MODELS, QUICK_LARGEST_M if quick else None)
    bars, done, shown = ProgressBars({"match": "matching"}), 0, ""

    def show_cell(cell: str) -> None:
        nonlocal shown
        shown = cell.ljust(_LABEL_WIDTH)
        bars.show("match", done, len(where) * len(chosen), shown)

    def keep(_: object) -> None:
        nonlocal done
        if json_file is not None:
            write_results(json_file, results)
        done += 1
        show_cell(shown)

    with bars:
        run_bench(results, where, chosen, plan, workers=workers, started=show_cell, finished=keep)
    show(format_bench_markdown(results) if markdown else format_bench(results))
    if plot is not None:
        save_bench_plot(plot, results)


def _installed(names: tuple[str, ...]) -> list[BenchMatcher]:
    """Return the matchers of these names; of all, with a note, those that are installed."""
    from fpmatch.lab.points.bench.matchers import MATCHER_NAMES, is_installed, matcher_named

    if names:
        return [matcher_named(name) for name in dict.fromkeys(names)]
    for name in MATCHER_NAMES:
        if not is_installed(name):
            say_note(f"{name} is left out: pip install 'fpmatch[bench]'")
    return [matcher_named(name) for name in MATCHER_NAMES if is_installed(name)]


def _results(plan: TrialPlan, workers: int, old: Path | None) -> BenchResults:
    """Return results to add to: those of the file `old`, where there is one."""
    from fpmatch.lab.points.bench.bench import check_same_settings, describe_settings
    from fpmatch.lab.points.bench.results import BenchResults, read_results

    settings = describe_settings(plan, workers)
    if old is None or not old.exists():
        return BenchResults(settings)
    results = read_results(old)
    check_same_settings(str(old), results.settings, settings)
    return results
