"""The engines of this machine: this process, and several worker processes."""

from __future__ import annotations

import multiprocessing
import sys
import warnings
from collections import deque
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

from fpmatch.base.threads import available_cores, environment
from fpmatch.errors import EngineError
from fpmatch.gallery.engine.processes import (
    interrupt_deferred,
    main_hidden,
    safe_import_path,
    single_threaded,
)
from fpmatch.gallery.engine.task import Task, init_worker, pack_task, run_chunk, task_in_memory

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Generator, Iterable
    from concurrent.futures import Future, ProcessPoolExecutor
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")
Pending = TypeVar("Pending")

# A fork server forks each worker from a process that has imported what it needs and run nothing.
_START_METHOD: Final = "forkserver" if sys.platform == "linux" else "spawn"
CHUNKS_IN_FLIGHT: Final = 4  # of each worker: worked on, waiting, or with a result to be taken
_EVERY_WORKER_NEEDS: Final = (
    "fpmatch.gallery.engine._fork_server",
    "fpmatch.gallery.engine.task",
    "concurrent.futures.process",
    "multiprocessing.synchronize",
)
_BROKEN: Final = "a worker process ended before its work was done: out of memory?"
_ONE_PROCESS: Final = (
    "one process works, not several: a function or class is defined in a notebook or in a script "
    'without `if __name__ == "__main__":`'
)


def results_in_order(
    chunks: Iterable[Chunk],
    submit: Callable[[Chunk], Pending],
    result: Callable[[Pending], Result],
    most_pending: Callable[[], int],
    cancel: Callable[[Collection[Pending]], object] = lambda _: None,
) -> Generator[Result, None, None]:
    """Submit chunks and yield their results in order; `most_pending` are submitted at a time.

    Those whose results were not taken when the generator is closed or an error is raised are
    cancelled, but for an EngineError, after which nothing is left that would work on them.
    """
    pending: deque[Pending] = deque()
    try:
        for chunk in chunks:
            pending.append(submit(chunk))
            if len(pending) >= most_pending():
                yield result(pending.popleft())
        while pending:
            yield result(pending.popleft())
    except EngineError:
        pending.clear()
        raise
    finally:
        cancel(pending)


def start_fork_server(workers: int | None, *modules: str) -> None:
    """Start importing the modules that workers will need, in the process they are forked from.

    For the main thread of a program, not for libraries: that process is started once in the life
    of a program. Without effect for one worker (None: one a core), or where they are not forked.
    """
    if _START_METHOD != "forkserver" or (workers or available_cores()) == 1:
        return
    from multiprocessing import forkserver  # noqa: PLC0415

    context = multiprocessing.get_context(_START_METHOD)
    context.set_forkserver_preload([*_EVERY_WORKER_NEEDS, *modules])
    # numpy starts no threads in a process that forks
    single = environment("OPENBLAS_NUM_THREADS", "1")
    with interrupt_deferred(), safe_import_path(), single:
        forkserver.ensure_running()


class Serial:
    """Work in this process; see `fpmatch.gallery.engine.engine.Engine`."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def map(
        self, work: Callable[[Shared, Chunk], Result], shared: Shared, chunks: Iterable[Chunk]
    ) -> Generator[Result, None, None]:
        """Work on each chunk when its result is requested."""
        with single_threaded():
            for chunk in chunks:
                yield work(shared, chunk)


class Processes:
    """Work in `workers` processes; see `fpmatch.gallery.engine.engine.Engine`."""

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._held = 0  # blocks that hold the workers
        self._has_main = False  # whether workers have imported the script that was started
        self._executor: ProcessPoolExecutor | None = None

    def __enter__(self) -> Self:
        self._held += 1
        return self

    def __exit__(self, *_: object) -> None:
        self._held -= 1
        if self._held:
            return
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.shutdown(cancel_futures=True)

    def map(
        self, work: Callable[[Shared, Chunk], Result], shared: Shared, chunks: Iterable[Chunk]
    ) -> Generator[Result, None, None]:
        """Submit a few chunks at a time, and yield their results in order."""
        from concurrent.futures.process import BrokenProcessPool  # noqa: PLC0415  (as in `_start`)

        packed = pack_task(work, shared)
        needs_main = b"__main__" in packed  # a function or type of the script that was started
        if needs_main and not _main_has_guard():
            warnings.warn(_ONE_PROCESS, RuntimeWarning, stacklevel=2)
            yield from Serial().map(work, shared, chunks)
            return
        start = nullcontext if needs_main else main_hidden
        executor = self._open(needs_main=needs_main)

        def submit(task: Task, chunk: Chunk) -> Future[Any]:
            # submitting may start a worker
            with interrupt_deferred(), safe_import_path(), start():
                return executor.submit(run_chunk, task, chunk)

        try:
            with task_in_memory(packed) as task:
                yield from results_in_order(
                    chunks,
                    partial(submit, task),
                    lambda future: future.result(),
                    lambda: CHUNKS_IN_FLIGHT * self._workers,
                )
        except BrokenProcessPool as error:
            if self._executor is executor:
                self._executor = None
            raise EngineError(_BROKEN) from error
        finally:
            if self._executor is not executor:
                executor.shutdown(cancel_futures=True)

    def _open(self, *, needs_main: bool) -> ProcessPoolExecutor:
        """Return the pool that is held, or a new one, whose workers import the script if needed."""
        if self._executor is not None and needs_main and not self._has_main:
            self._executor.shutdown()
            self._executor = None
        executor = self._executor or _start(self._workers)
        if self._held and self._executor is None:
            self._executor, self._has_main = executor, needs_main
        return executor


def _main_has_guard() -> bool:
    """Return whether workers can import the script that was started without running it again."""
    import ast  # noqa: PLC0415  (seldom needed)

    file = getattr(sys.modules["__main__"], "__file__", None)
    try:
        statements = ast.parse(Path(file or "").read_bytes()).body
    except (OSError, SyntaxError, ValueError):  # a notebook, a prompt, a program in one file
        return False
    tests = [ast.dump(one.test) for one in statements if isinstance(one, ast.If)]
    return any("'__name__'" in test and "'__main__'" in test for test in tests)


def _start(workers: int) -> ProcessPoolExecutor:
    from concurrent.futures import ProcessPoolExecutor  # noqa: PLC0415  (while the server starts)

    context = multiprocessing.get_context(_START_METHOD)
    if _START_METHOD == "forkserver":  # else it would import the script, once it is started
        context.set_forkserver_preload(list(_EVERY_WORKER_NEEDS))
    with safe_import_path():  # its locks start a process of Python's that tracks them
        return ProcessPoolExecutor(max_workers=workers, mp_context=context, initializer=init_worker)
