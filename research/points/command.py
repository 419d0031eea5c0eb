"""``python -m research measure points``: the paper's experiment on random point sets."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import click
from threadpoolctl import threadpool_limits

from fpmatch.errors import FpmatchError
from research.commands import Command, json_file, read_json, write_json
from research.points.conditions import Condition, conditions
from research.points.matchers import MATCHERS
from research.points.random_sets import POINT_MODELS
from research.points.trials import COMPLETE, QUICK_LARGEST_M, QUICK_PLAN, TrialPlan, run_cell
from research.tables import format_points

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from research.points.random_sets import PointModel

    Cell = Mapping[str, Any]

_FROM_1 = click.IntRange(1)


@click.command(
    cls=Command,
    epilog="""\b
Matchers:
  triangles    the default of `fpmatch points`
  paper        the paper's method, which matches where more than a share rho of P is paired
  van-wamelen  the baseline of the paper, given the true rho and lambda

\b
Models of where P's partners lie in Q:
  patch        in a part of Q as large as P, so that neighbours stay neighbours
  clutter      anywhere in Q, with other points between them

\b
Examples:
  python -m research measure points --quick
  python -m research measure points --json bench.json
""",
)
@click.option("--trials", type=_FROM_1, help="Pairs of sets a cell.  [default: 100]")
@click.option("--independent-trials", type=_FROM_1, help="Independent pairs.  [default: 20]")
@click.option("--matcher", "matchers", multiple=True, type=click.Choice(list(MATCHERS)))
@click.option("--model", "models", multiple=True, type=click.Choice(POINT_MODELS))
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@click.option(
    "--budget",
    "budget_s",
    metavar="SECONDS",
    type=click.FloatRange(min=0, min_open=True),
    help="Time after which matchers other than triangles try no more pairs of a kind in a cell, "
    "after five at least.  [default: 0.7]",
)
@click.option("--quick", is_flag=True, help="A run of a minute: rows up to m = 100, few pairs.")
@json_file
def command(
    matchers: tuple[str, ...],
    models: tuple[PointModel, ...],
    quick: bool,
    json_file: Path | None,
    **given: float | None,
) -> None:
    """Repeat the paper's experiment on random point sets.

    For each of the 13 rows of the paper's tables, and n = 2m, 4m and 8m, every matcher is tried on
    pairs of random sets: on pairs that have points in common, for its time and how often it finds
    the true transform, and on independent pairs, for its false positives. The results are printed
    beside the paper's own times.

    Times are processor times of one thread. A full run takes an hour or more. The file of --json is
    written after each cell; a run with the same settings continues it.
    """
    changed: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    plan = replace(QUICK_PLAN if quick else TrialPlan(), **changed)
    where = conditions(models or POINT_MODELS, QUICK_LARGEST_M if quick else None)
    results: dict[str, Any] = {"plan": asdict(plan), "cells": [], "left_out": []}
    if json_file and json_file.exists():
        results = read_json(json_file)
        if results.get("plan") != asdict(plan):
            raise FpmatchError(f"{json_file}: has results of other settings")
    known = {_key(one) for kind in ("cells", "left_out") for one in results[kind]}
    with threadpool_limits(1):
        for condition, name in product(where, matchers or MATCHERS):
            if (condition, name) in known:
                continue
            click.echo(f"{name}, {condition}", err=True)
            if name != COMPLETE and _takes_too_long(results, condition, name, plan):
                results["left_out"].append({**condition._asdict(), "matcher": name})
            else:
                results["cells"].append(run_cell(condition, name, plan))
            if json_file:
                write_json(json_file, results)
    click.echo(format_points(json.loads(json.dumps(results))))


def _takes_too_long(
    results: Mapping[str, Any], condition: Condition, matcher: str, plan: TrialPlan
) -> bool:
    """Return whether a matcher took longer than the budget on smaller sets of the same kind."""
    slow = [one for one in results["cells"] if one["first_ms"] > 1e3 * plan.budget_s]
    too_long = map(_key, [*slow, *results["left_out"]])
    return any(name == matcher and condition.is_harder_than(at) for at, name in too_long)


def _key(cell: Cell) -> tuple[Condition, str]:
    return Condition(cell["model"], cell["row"], cell["factor"]), cell["matcher"]
