"""The experiment on random point sets: every matcher under every condition.

Cells run condition by condition, so that the times of the matchers under one condition are taken
close together. Where a matcher's first genuine match took longer than the budget, it is not tried
on larger sets of the same ρ, η and λ and the same model.
"""

from __future__ import annotations

import os
import platform
from dataclasses import asdict
from importlib.metadata import version
from importlib.util import find_spec
from itertools import product
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.errors import FpmatchError
from research.points.matchers import StoppedError
from research.points.results import SkippedCell
from research.points.trials import run_cell

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from research.points.conditions import Condition
    from research.points.matchers import BenchMatcher
    from research.points.results import BenchResults, PointCell
    from research.points.trials import TrialPlan

    Outcome = PointCell | SkippedCell

_LIBRARIES: Final = ("numpy", "scipy", "astroalign")


def describe_settings(plan: TrialPlan) -> dict[str, Any]:
    """Return the plan, versions and the machine, as JSON values."""
    from fpmatch.pointset.delaunay import _delaunay_kernel  # noqa: PLC0415

    return {
        **asdict(plan),
        "kernels": "compiled" if _delaunay_kernel.COMPILED else "interpreted",
        "versions": {
            "fpmatch": __version__,
            "python": platform.python_version(),
            **{name: version(name) if find_spec(name) else None for name in _LIBRARIES},
        },
        "machine": {"system": f"{platform.system()} {platform.machine()}", "cpus": os.cpu_count()},
    }


def check_same_settings(name: str, old: dict[str, Any], new: dict[str, Any]) -> None:
    """Raise an `FpmatchError` where results of file `name` have other settings than a new run."""
    was, now = _flat(old), _flat(new)
    differing = [
        f"{key} was {was.get(key)}, is {now.get(key)}"
        for key in {**now, **was}
        if was.get(key) != now.get(key)
    ]
    if differing:
        raise FpmatchError(f"{name}: cannot resume with other settings: {'; '.join(differing)}")


def run_bench(
    results: BenchResults,
    conditions: Sequence[Condition],
    matchers: Sequence[BenchMatcher],
    plan: TrialPlan,
    *,
    started: Callable[[str], None] = lambda _: None,
    finished: Callable[[Outcome], None] = lambda _: None,
) -> None:
    """Run the cells that are not among the results yet, one after the other, and add them."""
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    earlier: list[Outcome] = [*results.cells, *results.skipped]
    known = {(cell.condition, cell.matcher): cell for cell in earlier}
    with threadpool_limits(1):
        for condition, matcher in product(conditions, matchers):
            started(f"{matcher.name}, {condition}")
            outcome = known.get((condition, matcher.name))
            if outcome is None:
                outcome = _run(results, condition, matcher, plan)
                results.add(outcome)
            finished(outcome)


def _run(
    results: BenchResults, condition: Condition, matcher: BenchMatcher, plan: TrialPlan
) -> Outcome:
    """Run a cell, unless it would take too long after what the results say."""
    reason = "" if matcher.complete else _why_too_long(results, condition, matcher.name, plan)
    if not reason:
        try:
            return run_cell(condition, matcher, plan)
        except StoppedError:
            reason = f"a match was stopped after {plan.budget_s:g} s"
    return SkippedCell(condition, matcher.name, reason)


def _why_too_long(
    results: BenchResults, condition: Condition, matcher: str, plan: TrialPlan
) -> str:
    """Return why a cell would take too long, or ""."""
    slow: list[Outcome] = [c for c in results.cells if c.first_ms > 1e3 * plan.budget_s]
    for cell in [*slow, *results.skipped]:
        if cell.matcher == matcher and condition.is_harder_than(cell.condition):
            return f"a match took over {plan.budget_s:g} s at {cell.condition}"
    return ""


def _flat(settings: dict[str, Any]) -> dict[str, Any]:
    flat = {}
    for key, value in settings.items():
        flat.update(_flat(value) if isinstance(value, dict) else {key: value})
    return flat
