"""The command ``scale``: constants are measured, and galleries planned from them."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import click

from fpmatch.errors import FpmatchError
from fpmatch.gallery.index.loss import DEFAULT_LOSS
from research.commands import PATH, Command, folders, json_file, print_and_write, workers
from research.databases import extract_folders
from research.scale.constants import Assumptions, Constants
from research.scale.measure import measure as measured_constants
from research.scale.plan import SEARCHES, limits, make_plan
from research.scale.simulate import load_rows, loss_row
from research.tables.pages import read_json
from research.tables.scale import format_constants, format_scale

if TYPE_CHECKING:
    from pathlib import Path

LOADS = (0.5, 1.0, 1.5, 1.9)


@click.group(
    epilog="""\b
Examples:
  python -m research scale measure DIR... --searching docs/data/searching.json --json constants.json
  python -m research scale plan constants.json --json plan.json
  python -m research scale plan constants.json --cores 64 --memory-gb 512 --core-hour 0.03
  python -m research tables scale --plan plan.json
"""
)
def command() -> None:
    """Plan galleries of ten million prints and more, by measured constants and simulation."""


@command.command(cls=Command)
@folders
@click.option(
    "--searching",
    type=PATH,
    required=True,
    help="Results of research/benchmarks/large_galleries.py --json: the times of searches.",
)
@workers
@json_file
def measure(
    folders: tuple[Path, ...], searching: Path, workers: int | None, json_file: Path | None
) -> None:
    """Measure the constants of a plan on the prints of FVC-style databases DIR."""
    calls = search_calls(read_json(searching))
    found = measured_constants(extract_folders(folders, workers), calls)
    print_and_write(format_constants(Constants.from_dict(found)), found, json_file)


def search_calls(results: Any) -> list[tuple[int, float]]:
    """Return prints and calls of Delaunay of a search by default, as `large_galleries.py` wrote."""
    try:
        rows = [
            (int(row["prints"]), float(row["calls"]))
            for row in results["speed"]
            if row["plan"]["loss"] == DEFAULT_LOSS and not row["threshold"]
        ]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise FpmatchError(f"results of large galleries: {error!r}") from error
    return sorted(rows)


def plan_all(c: Constants, a: Assumptions) -> dict[str, Any]:
    """Return all that the page shows, as JSON values."""
    plans = [make_plan(prints, rate, c, a) for prints, rate in SEARCHES.items()]
    return {
        "assumptions": a.as_dict(),
        "plans": [plan.as_dict() for plan in plans],
        "loads": [load_rows(plan, a, LOADS) for plan in plans],
        "losses": [
            [
                loss_row(plan, a, replicas=plan.replicas, down_s=plan.copy_s),
                loss_row(plan, a, replicas=1, down_s=plan.rebuild_s),
            ]
            for plan in plans
        ],
        "limits": [list(row) for row in limits(c, a)],
    }


def _assumption_options(function: Any) -> Any:
    usual = Assumptions()
    for one in reversed(fields(Assumptions)):
        value = getattr(usual, one.name)
        name = f"--{one.name.replace('_', '-')}"
        option = click.option(name, one.name, default=value, type=type(value), show_default=True)
        function = option(function)
    return function


@command.command(cls=Command)
@click.argument("constants", type=PATH)
@json_file
@_assumption_options
def plan(constants: Path, json_file: Path | None, **given: Any) -> None:
    """Plan galleries of 10 million to a billion prints from measured CONSTANTS.

    The other options are assumptions: the machine (cores, memory, disk, network), how much of it is
    used, the spread of the times of searches, and prices of a core-hour and of a GB for a month.
    """
    for name, value in given.items():
        if not value > 0:
            raise FpmatchError(f"{name}: {value:g} is not positive")
    document = read_json(constants)
    made = {"constants": document, **plan_all(Constants.from_dict(document), Assumptions(**given))}
    print_and_write("\n\n".join(format_scale(made).values()), made, json_file)
