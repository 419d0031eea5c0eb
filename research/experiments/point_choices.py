"""Choices that the paper leaves open, measured on random point sets.

They are the area tolerance, the decision rule, and the largest number of proposals of the default
matcher. The pairs of sets are made as by ``python -m research measure points``.
"""

from __future__ import annotations

import time
from dataclasses import replace
from statistics import median
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from fpmatch.gallery.engine.engine import processes
from fpmatch.lab.evaluation.databases.dataset import with_unique_names
from fpmatch.lab.evaluation.databases.extraction import extract_datasets
from fpmatch.lab.evaluation.run import evaluate_templates, load_datasets
from fpmatch.lab.points.triangles.matcher import TriangleParameters, match_by_triangles
from fpmatch.matching.matchers.paper import PaperMatcher
from fpmatch.pointset.geometry.point_match import share_of
from fpmatch.pointset.paper.matcher import UnitCircleParameters, match_prepared, similar_rings
from fpmatch.pointset.paper.one_rings import prepare_points
from research.commands import PATH, Command, folders, write_json
from research.points.conditions import conditions, make_pair
from research.points.trials import is_recognised
from research.tables.points import count_accepted

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from research.points.conditions import Condition

AREA_TOLERANCES: Final = (0.1, 0.03, 0.01)
EXITS: Final = (1, 4, 16, 64, 0)
"""Largest numbers of proposals per point of Q of the default matcher; 0 for its default."""
LARGEST_M: Final = 200
FORMER_SHARE: Final = 0.8
"""Share of ⌈ρm⌉ points in the decision rule of an earlier version."""
SEED: Final = 0
_ANY_AREA: Final = 8.0  # more than any two areas on the unit circle differ
_MS: Final = 1e3


def measure_paper(condition: Condition, area_tolerance: float, trials: int) -> dict[str, Any]:
    """Measure the paper's method at one condition with one area tolerance.

    ``passing`` is the share of similar pairs among the ring pairs of equal degree. Positives are
    counted by the paper's rule, more than ρ of the points; with the suffix ``_at_rho`` by ρ or more
    of them, and with ``_80`` by 80 % of ⌈ρm⌉.
    """
    rho, fewest = (
        condition.parameters.rho,
        FORMER_SHARE * share_of(condition.parameters.rho, condition.m),
    )
    counts = {
        f"{answer}{rule}": 0
        for rule in ("", "_at_rho", "_80")
        for answer in ("true_positives", "false_positives")
    }
    similar = equal = 0
    seconds: dict[bool, list[float]] = {True: [], False: []}
    for genuine in (True, False):
        for trial in range(trials):
            pair = make_pair(condition, SEED, trial, genuine=genuine)
            given = UnitCircleParameters(
                area_tolerance=area_tolerance, tolerance=pair.tolerance, matching_factor=rho
            )
            start = time.process_time()
            p, q = prepare_points(pair.p), prepare_points(pair.q)
            match = match_prepared(p, q, given)
            seconds[genuine].append(time.process_time() - start)
            similar += match.local_matches
            equal += len(similar_rings(p.rings, q.rings, _ANY_AREA))
            found = "true_positives" if genuine else "false_positives"
            holds = not genuine or is_recognised(match, pair)
            counts[found] += holds and match.matched_share > rho
            counts[f"{found}_at_rho"] += holds and match.matched_share >= rho
            counts[f"{found}_80"] += holds and len(match.pairs) >= fewest
    return {
        **_named(condition),
        "area_tolerance": area_tolerance,
        "trials": trials,
        "passing": similar / equal if equal else 0.0,
        "median_ms": _MS * median(seconds[True]),
        "independent_ms": _MS * median(seconds[False]),
        **counts,
    }


def measure_exit(
    condition: Condition, per_point: int, trials: int, independent_trials: int
) -> dict[str, Any]:
    """Measure the default matcher with so many proposals per point of Q at most (0: its own)."""
    parameters = TriangleParameters()
    if per_point:
        most = min(per_point * condition.n, parameters.most_proposals(condition.n))
        parameters = replace(parameters, max_proposals=most)
    times: dict[bool, list[float]] = {True: [], False: []}
    recognised = 0
    for genuine, count in ((True, trials), (False, independent_trials)):
        for trial in range(count):
            pair = make_pair(condition, SEED, trial, genuine=genuine)
            start = time.process_time()
            match = match_by_triangles(
                pair.p, pair.q, tolerance=pair.tolerance, parameters=parameters
            )
            times[genuine].append(_MS * (time.process_time() - start))
            recognised += genuine and is_recognised(match, pair)
    return {
        **_named(condition),
        "proposals_per_point": per_point,
        "trials": trials,
        "true_positives": recognised,
        "median_ms": median(times[True]),
        "longest_ms": max(times[True]),
        "independent_ms": median(times[False]),
    }


def measure_points(
    trials: int, finished: Callable[[str], None] = lambda _: None
) -> dict[str, list[dict[str, Any]]]:
    """Measure both matchers at every condition with up to 200 points of P."""
    few = max(1, trials // 4)
    found: dict[str, list[dict[str, Any]]] = {"paper": [], "exits": []}
    for condition in conditions(largest_m=LARGEST_M):
        number = few if condition.m == LARGEST_M else trials
        measure_paper(condition, AREA_TOLERANCES[0], 1)  # loads what the timed runs need
        found["paper"] += [measure_paper(condition, area, number) for area in AREA_TOLERANCES]
        paper_ms = found["paper"][-len(AREA_TOLERANCES)]["independent_ms"]
        found["exits"] += [
            {**measure_exit(condition, each, few, max(1, few // 2)), "paper_ms": paper_ms}
            for each in EXITS
        ]
        finished(str(condition))
    return found


def _named(condition: Condition) -> dict[str, Any]:
    return {
        "model": condition.model,
        "rho": condition.parameters.rho,
        "m": condition.m,
        "n": condition.n,
    }


@click.command(cls=Command)
@folders
@click.option("--json", "json_file", metavar="FILE", required=True, type=PATH, help="Results.")
@click.option("--trials", default=40, show_default=True, help="Pairs of point sets per condition.")
def command(folders: tuple[Path, ...], json_file: Path, trials: int) -> None:
    """Measure choices that the paper leaves open: rho and the area tolerance.

    DIR are FVC-style databases of prints, compared as by `fpmatch evaluate --protocol extended`. On
    random point sets, made as by `measure points`, up to 200 points, the area tolerance, the
    decision rule, and an early exit of the default matcher are measured. Times are processor times.
    """
    results: dict[str, Any] = {"prints": _prints(folders)}
    results |= measure_points(trials, lambda name: click.echo(name, err=True))
    write_json(json_file, results)


def _prints(folders: tuple[Path, ...]) -> list[dict[str, Any]]:
    """Return the numbers of pairs that match, by area tolerance and database."""
    rows = []
    with processes(1) as engine:
        sets = extract_datasets(with_unique_names(load_datasets(folders)), engine=engine)
        for area in AREA_TOLERANCES:
            matcher = PaperMatcher(area_tolerance=area)
            report = evaluate_templates(sets, matcher=matcher, engine=engine)
            counted = [
                count_accepted(row.name, row.outcomes["similarity"], row.pairs.genuine)
                for row in report.sets
            ]
            times = np.concatenate([row.outcomes["cpu_us"] for row in report.sets])
            rows.append({"area_tolerance": area, "ms": float(times.mean()) / 1e3, "sets": counted})
            click.echo(f"prints, area tolerance {area:g}", err=True)
    return rows
