"""The whole experiment on random point sets: every matcher at every place, and what was found.

Cells run place by place, so that the times of the matchers at one place are taken close together.
What would take too long is left out: where a matcher's first genuine match took longer than the
budget, it is not tried on larger sets of the same ρ, η and λ and the same reading.
"""

from __future__ import annotations

import multiprocessing
import os
import platform
import signal
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.errors import FpmatchError
from fpmatch.evaluation.points.matchers import StoppedError, matcher_named
from fpmatch.evaluation.points.results import PointCell, SkippedCell
from fpmatch.evaluation.points.trials import run_cell

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from fpmatch.evaluation.points.matchers import BenchMatcher
    from fpmatch.evaluation.points.places import Place
    from fpmatch.evaluation.points.results import BenchResults
    from fpmatch.evaluation.points.trials import TrialPlan

    Outcome = PointCell | SkippedCell

_LIBRARIES: Final = ("numpy", "scipy", "astroalign")
_MS: Final = 1e3


def describe_settings(plan: TrialPlan, workers: int = 1) -> dict[str, Any]:
    """Return what the results of an experiment depend on, as JSON values.

    Parameters
    ----------
    plan : TrialPlan
        How much is tried.
    workers : int
        Processes at work at one time.

    Returns
    -------
    dict
        The plan, versions, and words on the machine.
    """
    from fpmatch.pointset.delaunay import _delaunay_kernel  # noqa: PLC0415

    return {
        **asdict(plan),
        "workers": workers,
        "kernels": "compiled" if _delaunay_kernel.COMPILED else "interpreted",
        "versions": {
            "fpmatch": __version__,
            "python": platform.python_version(),
            **{name: _version_of(name) for name in _LIBRARIES},
        },
        "machine": {"system": f"{platform.system()} {platform.machine()}", "cpus": os.cpu_count()},
    }


def check_same_settings(name: str, old: dict[str, Any], new: dict[str, Any]) -> None:
    """Refuse to add to results that were made otherwise.

    Parameters
    ----------
    name : str
        The file of the old results.
    old, new : dict
        Settings, as `describe_settings` makes them.

    Raises
    ------
    FpmatchError
        If they differ; the message names what.
    """
    was, now = _flat(old), _flat(new)
    differing = [
        f"{key} was {was.get(key)}, is {now.get(key)}"
        for key in [*now, *(key for key in was if key not in now)]
        if was.get(key) != now.get(key)
    ]
    if differing:
        raise FpmatchError(f"{name}: cannot resume with other settings: {'; '.join(differing)}")


def run_bench(
    results: BenchResults,
    places: Sequence[Place],
    matchers: Sequence[BenchMatcher],
    plan: TrialPlan,
    *,
    workers: int = 1,
    started: Callable[[str], None] = lambda _: None,
    finished: Callable[[Outcome], None] = lambda _: None,
) -> None:
    """Run the cells that are not among the results yet, and add them.

    Parameters
    ----------
    results : BenchResults
        What was found before, and where to add.
    places : sequence of Place
        Where in the tables.
    matchers : sequence of BenchMatcher
        Whom to try there.
    plan : TrialPlan
        How much to try.
    workers : int
        Processes to use; 1 works in this one. With more, the cores' shared caches and clock slow
        all matchers alike: times of one cell stay comparable with one another, no longer with
        those of a quiet machine. Matchers must be those of `matcher_named` then.
    started : callable
        Called with a cell's name when it begins, or is found done or skipped.
    finished : callable
        Called with each cell of `places`, once it is among the results.

    Raises
    ------
    FpmatchError
        If a worker process died.
    """
    cells = [(place, matcher) for place in places for matcher in matchers]
    queue = _Queue(results, cells, plan, started, finished)
    if workers == 1:
        queue.work_here()
    else:
        queue.work_in_processes(workers)


class _Queue:
    """The cells still to run, and what becomes of each."""

    def __init__(
        self,
        results: BenchResults,
        cells: list[tuple[Place, BenchMatcher]],
        plan: TrialPlan,
        started: Callable[[str], None],
        finished: Callable[[Outcome], None],
    ) -> None:
        self._results, self._cells, self._plan = results, cells, plan
        self._started, self._finished = started, finished

    def work_here(self) -> None:
        """Run the cells in this process, one after the other."""
        from threadpoolctl import threadpool_limits  # noqa: PLC0415

        with threadpool_limits(1):
            for place, matcher in self._open_cells():
                self._add(_run(place, matcher, self._plan))

    def work_in_processes(self, workers: int) -> None:
        """Keep so many processes busy, a cell each."""
        pool = ProcessPoolExecutor(
            max_workers=workers,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_start_worker,
        )
        try:
            running = set()
            for place, matcher in self._open_cells():
                running.add(pool.submit(_run_named, place, matcher.name, self._plan))
                if len(running) == workers:
                    done, running = wait(running, return_when=FIRST_COMPLETED)
                    for future in done:
                        self._add(future.result())
            for future in running:
                self._add(future.result())
        except BrokenProcessPool as error:
            raise FpmatchError("a worker process ended before its work was done") from error
        finally:
            pool.shutdown(cancel_futures=True)

    def _open_cells(self) -> Iterator[tuple[Place, BenchMatcher]]:
        """Yield the cells to run, and settle those that need none as their turn comes."""
        settled: list[Outcome] = [*self._results.cells, *self._results.skipped]
        done = {(cell.place, cell.matcher): cell for cell in settled}
        for place, matcher in self._cells:
            self._started(f"{matcher.name}, {place}")
            known = done.get((place, matcher.name))
            reason = "" if matcher.complete else self._why_too_long(place, matcher.name)
            if known is not None:
                self._finished(known)
            elif reason:
                self._add(SkippedCell(place, matcher.name, reason))
            else:
                yield place, matcher

    def _add(self, outcome: Outcome) -> None:
        if isinstance(outcome, PointCell):
            self._results.cells.append(outcome)
        else:
            self._results.skipped.append(outcome)
        self._finished(outcome)

    def _why_too_long(self, place: Place, matcher: str) -> str:
        """Return why the cell would take too long, or nothing."""
        too_long: list[Outcome] = [
            *(c for c in self._results.cells if c.first_ms > _MS * self._plan.budget_s),
            *self._results.skipped,
        ]
        for cell in too_long:
            if cell.matcher == matcher and place.is_harder_than(cell.place):
                return f"a match took over {self._plan.budget_s:g} s at {cell.place}"
        return ""


def _run(place: Place, matcher: BenchMatcher, plan: TrialPlan) -> Outcome:
    try:
        return run_cell(place, matcher, plan)
    except StoppedError:
        return SkippedCell(place, matcher.name, f"a match was stopped after {plan.budget_s:g} s")


def _run_named(place: Place, matcher: str, plan: TrialPlan) -> Outcome:
    return _run(place, matcher_named(matcher), plan)


def _start_worker() -> None:
    import numpy as np  # noqa: F401, PLC0415  (its library is limited once it is loaded)
    from threadpoolctl import threadpool_limits  # noqa: PLC0415

    # Ctrl-C reaches the whole process group: a worker falls silent, its parent reports.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threadpool_limits(1)


def _version_of(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _flat(settings: dict[str, Any]) -> dict[str, Any]:
    flat = {}
    for key, value in settings.items():
        flat.update(_flat(value) if isinstance(value, dict) else {key: value})
    return flat
