"""Executors of this machine's processes and of a Dask cluster, and results in order."""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import signal
import sys
import threading
import time
from collections import deque
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeVar

from fpmatch._version import __version__
from fpmatch.base.threads import available_cores, environment
from fpmatch.errors import EngineError
from fpmatch.gallery.engine.worker import init_worker

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator

Chunk = TypeVar("Chunk")
Result = TypeVar("Result")

POLL_S: Final = 2.0  # how long a result is waited for before the workers are looked at
CONNECT_S: Final = 10.0  # time limit for the scheduler to answer
NO_WORKERS_S: Final = 60.0  # time limit for a cluster without workers
_BROKEN: Final = "a worker process ended before its work was done: out of memory?"
_LOST: Final = "the connection to the scheduler is lost"
_KILLED: Final = "the same piece of work has ended several workers; out of memory?"
_starting: Final = threading.RLock()  # what a process inherits is shared by all threads


@dataclass(frozen=True, slots=True)
class Workers:
    """An executor and what is known of its workers.

    `count` returns how many there are; `check`, called while a result is waited for, raises
    EngineError where none will come; `explain` says why an error means that the executor is
    broken, and returns None for an error of the work.
    """

    executor: Executor
    count: Callable[[], int]
    check: Callable[[], object]
    explain: Callable[[Exception], str | None]


def in_order(
    submit: Callable[[Chunk], Future[Result]],
    chunks: Iterable[Chunk],
    window: Callable[[], int],
    check: Callable[[], object] = lambda: None,
) -> Generator[Result, None, None]:
    """Submit chunks and yield their results in order, or raise the error of the first one.

    So many chunks as `window` says are submitted before a result is taken, and `check` is called
    every `POLL_S` while one is waited for. At the end, or after an error, chunks that nobody has
    begun are cancelled.
    """
    pending: deque[Future[Result]] = deque()

    def first() -> Result:
        while True:
            try:
                result = pending[0].result(POLL_S)
            except TimeoutError:
                if pending[0].done():  # of the work
                    raise
                check()
            else:
                pending.popleft()
                return result

    try:
        for chunk in chunks:
            pending.append(submit(chunk))
            if len(pending) >= window():
                yield first()
        while pending:
            yield first()
    finally:
        for future in pending:
            future.cancel()


@contextmanager
def open_executor(workers: int | None = None, scheduler: str | None = None) -> Iterator[Workers]:
    """Start processes of this machine (default: one a core), or connect with a Dask cluster.

    At the end of the block the processes have ended. Raises EngineError if Dask is not installed,
    or no scheduler answers at the address.
    """
    with _processes(workers) if scheduler is None else _cluster(scheduler) as opened:
        yield opened


class _Pool(ProcessPoolExecutor):
    """Processes that import nothing from the working directory, and not the script again."""

    def submit(self, *call: Any, **named: Any) -> Future[Any]:
        """Submit a call, which may start a process."""
        with _quiet_start():
            return super().submit(*call, **named)


@contextmanager
def _processes(workers: int | None) -> Iterator[Workers]:
    count = workers or available_cores()
    with _quiet_start():  # its locks start a process of Python's that tracks them
        # Nothing is left in the temporary folder if this process is killed: no fork server's socket
        # or shared memory.
        context = multiprocessing.get_context("spawn")
        pool = _Pool(count, context, initializer=init_worker)
    try:
        for _ in range(count):
            pool.submit(int)
        yield Workers(
            pool,
            lambda: count,
            lambda: None,
            lambda error: _BROKEN if isinstance(error, BrokenProcessPool) else None,
        )
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def _quiet_start() -> Iterator[None]:
    """Start Python processes that ignore Ctrl-C and import from where this one does.

    Python would put the working directory first on their path, and let them run the script that
    the user has started a second time, up to where it calls the library, unless it has a guard.
    """
    main = sys.modules["__main__"]
    with ExitStack() as stack:
        stack.enter_context(_starting)
        stack.enter_context(environment("PYTHONSAFEPATH", "1"))
        for name in ("__file__", "__spec__"):
            if hasattr(main, name):
                stack.callback(setattr, main, name, getattr(main, name))
                setattr(main, name, None)
        if threading.current_thread() is threading.main_thread():
            stack.callback(signal.signal, signal.SIGINT, signal.getsignal(signal.SIGINT))
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        yield


@contextmanager
def _cluster(scheduler: str) -> Iterator[Workers]:
    try:
        import dask  # noqa: PLC0415
        import distributed  # noqa: PLC0415
    except ImportError as error:
        raise EngineError(
            "Dask is not installed; a scheduler needs it: pip install 'fpmatch[dask]'"
        ) from error
    connect: Any = distributed.Client
    with ExitStack() as stack:
        stack.enter_context(_dask_silenced())
        no_limit = {"distributed.admin.large-graph-warning-threshold": "1TB"}
        stack.enter_context(dask.config.set(no_limit))
        try:
            asyncio.run(asyncio.wait_for(_check_scheduler(distributed, scheduler), CONNECT_S))
            client = stack.enter_context(
                connect(scheduler, timeout=CONNECT_S, set_as_default=False)
            )
        except Exception as error:  # Dask raises almost anything
            why = _first_line(error) or f"no answer within {CONNECT_S:g} s"
            raise EngineError(f"{scheduler}: no Dask scheduler answers: {why}") from error
        seen = _ClusterSeen(client, scheduler)
        executor = client.get_executor(pure=False)
        yield Workers(executor, seen.count, seen.check, seen.explain)


async def _check_scheduler(distributed: Any, address: str) -> None:
    """Check that a scheduler answers: a client would wait for ever for another server."""
    async with distributed.core.rpc(address, timeout=CONNECT_S) as other:
        kind = (await other.identity())["type"]
    if kind != "Scheduler":
        raise ValueError(f"this is a {kind.lower()}'s address")


class _ClusterSeen:
    """What is seen of a cluster: its workers, asked at most every `POLL_S` seconds."""

    def __init__(self, client: Any, scheduler: str) -> None:
        self._client, self._scheduler = client, scheduler
        self._workers = 0
        self._counted, self._seen = -POLL_S, time.monotonic()

    def count(self) -> int:
        """Return the number of workers, at least 1."""
        if time.monotonic() - self._counted >= POLL_S:
            self.check()
        return max(1, self._workers)

    def check(self) -> None:
        """Count the workers.

        Raises EngineError if the scheduler is lost, or no worker has answered for `NO_WORKERS_S`.
        """
        self._counted = time.monotonic()
        try:
            with suppress(TimeoutError):  # of a scheduler that hangs
                ask = self._client.scheduler.ncores
                self._workers = len(self._client.sync(ask, callback_timeout=CONNECT_S))
                self._seen = self._counted if self._workers else self._seen
        except Exception as error:
            raise self._error(_LOST) from error
        if self._client.status != "running":
            raise self._error(_LOST)
        if time.monotonic() - self._seen > NO_WORKERS_S:
            raise self._error(f"no worker has answered for {NO_WORKERS_S:g} seconds")

    def explain(self, error: Exception) -> str | None:
        """Return why the cluster is broken, None for an error of the work."""
        from distributed import KilledWorker  # noqa: PLC0415

        if isinstance(error, KilledWorker):
            return f"{self._scheduler}: {_KILLED}"
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, ImportError) and (cause.name or "").startswith("fpmatch"):
                why = f"a worker cannot import fpmatch {__version__}: {_first_line(cause)}"
                return f"{self._scheduler}: {why}"
            cause = cause.__cause__
        if isinstance(error, CancelledError) or self._client.status != "running":
            return f"{self._scheduler}: {_LOST}"
        return None

    def _error(self, why: str) -> EngineError:
        return EngineError(f"{self._scheduler}: {why}")


def _first_line(error: BaseException) -> str:
    """Return the first line of the message of an error, "" where it has none."""
    return next(iter(str(error).splitlines()), "")


@contextmanager
def _dask_silenced() -> Iterator[None]:
    """Keep Dask from logging failures that become an `EngineError`."""
    loggers = logging.root.manager.loggerDict
    names = [name for name in loggers if name.split(".")[0] in {"asyncio", "distributed"}]
    levels = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)
