"""The experiment on random point sets: every matcher under every condition.

Cells run condition by condition, so that the times of the matchers under one condition are taken
close together. Where a matcher's first genuine match took longer than the budget, it is not tried
on larger sets of the same ρ, η and λ and the same model.
"""

from __future__ import annotations

import multiprocessing
import os
import platform
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from importlib.metadata import version
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.errors import FpmatchError
from fpmatch.gallery.engine.processes import interrupt_deferred, safe_import_path
from fpmatch.lab.points.bench.matchers import StoppedError, matcher_named
from fpmatch.lab.points.bench.results import PointCell, SkippedCell
from fpmatch.lab.points.bench.trials import run_cell

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from fpmatch.lab.points.bench.conditions import Condition
    from fpmatch.lab.points.bench.matchers import BenchMatcher
    from fpmatch.lab.points.bench.results import BenchResults
    from fpmatch.lab.points.bench.trials import TrialPlan

    Outcome = PointCell | SkippedCell

_LIBRARIES: Final = ("numpy", "scipy", "astroalign")


def describe_settings(plan: TrialPlan, workers: int = 1) -> dict[str, Any]:
    """Return the plan, the number of processes, versions and the machine, as JSON values."""
    from fpmatch.pointset.delaunay import _delaunay_kernel  # noqa: PLC0415

    return {
        **asdict(plan),
        "workers": workers,
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
    workers: int = 1,
    started: Callable[[str], None] = lambda _: None,
    finished: Callable[[Outcome], None] = lambda _: None,
) -> None:
    """Run the cells that are not among the results yet, and add them.

    `workers` processes are used; 1 runs in this one. More compete for shared caches and clock, so
    that only the times of one cell are comparable with one another, and matchers must be those of
    `matcher_named`. `started` is called with a cell's name when it begins, or is found done or
    skipped, and `finished` with each cell once it is among the results. Raises an `FpmatchError` if
    a worker process died.
    """
    cells = [(condition, matcher) for condition in conditions for matcher in matchers]
    queue = _Queue(results, cells, plan, started, finished)
    if workers == 1:
        queue.run_serially()
    else:
        queue.run_in_processes(workers)


@dataclass(frozen=True, slots=True)
class _Queue:
    """The cells still to run, and their results."""

    results: BenchResults
    cells: list[tuple[Condition, BenchMatcher]]
    plan: TrialPlan
    started: Callable[[str], None]
    finished: Callable[[Outcome], None]

    def run_serially(self) -> None:
        """Run the cells in this process, one after the other."""
        from threadpoolctl import threadpool_limits  # noqa: PLC0415

        with threadpool_limits(1):
            for condition, matcher in self._open_cells():
                self._add(_run(condition, matcher, self.plan))

    def run_in_processes(self, workers: int) -> None:
        """Run the cells in so many processes, a cell each at a time."""
        with safe_import_path():
            pool = ProcessPoolExecutor(
                max_workers=workers,
                mp_context=multiprocessing.get_context("spawn"),
                initializer=_start_worker,
            )
        try:
            running = set()
            for condition, matcher in self._open_cells():
                with interrupt_deferred(), safe_import_path():  # submitting may start a process
                    running.add(pool.submit(_run, condition, matcher.name, self.plan))
                if len(running) == workers:
                    done, running = wait(running, return_when=FIRST_COMPLETED)
                    for future in done:
                        self._add(future.result())
            for future in running:
                self._add(future.result())
        except BrokenProcessPool as error:
            raise FpmatchError("a worker process ended before its work was done") from error
        except KeyboardInterrupt:  # which does not reach the workers; a cell may take minutes
            for process in list(pool._processes.values()):
                process.terminate()
            raise
        finally:
            pool.shutdown(cancel_futures=True)

    def _open_cells(self) -> Iterator[tuple[Condition, BenchMatcher]]:
        """Yield the cells to run; finish the others in turn."""
        known: list[Outcome] = [*self.results.cells, *self.results.skipped]
        done = {(cell.condition, cell.matcher): cell for cell in known}
        for condition, matcher in self.cells:
            self.started(f"{matcher.name}, {condition}")
            earlier = done.get((condition, matcher.name))
            reason = "" if matcher.complete else self._why_too_long(condition, matcher.name)
            if earlier is not None:
                self.finished(earlier)
            elif reason:
                self._add(SkippedCell(condition, matcher.name, reason))
            else:
                yield condition, matcher

    def _add(self, outcome: Outcome) -> None:
        if isinstance(outcome, PointCell):
            self.results.cells.append(outcome)
        else:
            self.results.skipped.append(outcome)
        self.finished(outcome)

    def _why_too_long(self, condition: Condition, matcher: str) -> str:
        """Return why the cell would take too long, or ""."""
        too_long: list[Outcome] = [
            *(c for c in self.results.cells if c.first_ms > 1e3 * self.plan.budget_s),
            *self.results.skipped,
        ]
        for cell in too_long:
            if cell.matcher == matcher and condition.is_harder_than(cell.condition):
                return f"a match took over {self.plan.budget_s:g} s at {cell.condition}"
        return ""


def _run(condition: Condition, matcher: BenchMatcher | str, plan: TrialPlan) -> Outcome:
    chosen = matcher_named(matcher) if isinstance(matcher, str) else matcher
    try:
        return run_cell(condition, chosen, plan)
    except StoppedError:
        reason = f"a match was stopped after {plan.budget_s:g} s"
        return SkippedCell(condition, chosen.name, reason)


def _start_worker() -> None:
    import numpy as np  # noqa: F401, PLC0415  (its library is limited once it is loaded)
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    threadpool_limits(1)


def _flat(settings: dict[str, Any]) -> dict[str, Any]:
    flat = {}
    for key, value in settings.items():
        flat.update(_flat(value) if isinstance(value, dict) else {key: value})
    return flat
