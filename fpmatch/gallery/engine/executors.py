"""Executors: processes of this machine, and the workers of a Dask cluster."""

from __future__ import annotations

import logging
import signal
import sys
import threading
import time
from concurrent.futures import CancelledError, Executor, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import TYPE_CHECKING, Any, Final

from fpmatch._version import __version__
from fpmatch.base.threads import environment
from fpmatch.errors import EngineError
from fpmatch.gallery.engine.worker import init_worker

if TYPE_CHECKING:
    from collections.abc import Iterator

POLL_S: Final = 2.0  # how long a result is waited for before the workers are looked at
CONNECT_S: Final = 10.0  # time limit for the scheduler to answer
_BROKEN: Final = "a worker process ended before its work was done: out of memory?"
_LOST: Final = "the connection to the scheduler is lost"
_KILLED: Final = "the same piece of work has ended several workers; out of memory?"
_starting: Final = threading.RLock()  # what a process inherits is shared by all threads


class Workers:
    """An executor of this machine, and what is known of its `workers`."""

    def __init__(self, executor: Executor, workers: int) -> None:
        self.executor = executor
        self._workers = workers

    def count(self) -> int:
        """Return the number of workers, at least 1."""
        return self._workers

    def check(self) -> None:
        """Raise EngineError where no result will come; called while one is waited for."""

    def explain(self, error: Exception) -> str | None:
        """Return why an error means that the executor is broken, None for one of the work."""
        return _BROKEN if isinstance(error, BrokenProcessPool) else None


@contextmanager
def open_processes(count: int) -> Iterator[Workers]:
    """Start processes of this machine, which have ended at the end of the block."""
    # Spawned, nothing is left in the temporary folder if this process is killed: no fork server's
    # socket or shared memory.
    with ExitStack() as stack:
        with _interrupt_deferred():
            with _quiet_start():  # its locks start a process of Python's that tracks them
                pool = ProcessPoolExecutor(count, _QuietContext(), initializer=init_worker)
            stack.callback(pool.shutdown, cancel_futures=True)
            for _ in range(count):
                pool.submit(int)
        yield Workers(pool, count)


class _QuietProcess(SpawnProcess):
    """A process that imports nothing from the working directory, and not the script again."""

    def start(self) -> None:
        with _quiet_start():
            super().start()


class _QuietContext(SpawnContext):
    Process = _QuietProcess


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
        if hasattr(signal, "pthread_sigmask"):  # which new processes inherit
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            stack.callback(signal.pthread_sigmask, signal.SIG_SETMASK, before)
        yield


@contextmanager
def _interrupt_deferred() -> Iterator[None]:
    """Let a Ctrl-C in the block take effect at its end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: received.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if received:
            signal.raise_signal(signal.SIGINT)


@contextmanager
def open_cluster(scheduler: str) -> Iterator[Workers]:
    """Connect with a Dask cluster.

    Raises EngineError if Dask is not installed, or no scheduler answers at the address.
    """
    import asyncio  # noqa: PLC0415

    try:
        import dask  # noqa: PLC0415
        import distributed  # noqa: PLC0415
    except ImportError as error:
        raise EngineError(
            "Dask is not installed; a scheduler needs it: pip install 'fpmatch[dask]'"
        ) from error

    async def check_scheduler() -> None:
        """Check that a scheduler answers: a client would wait for ever for another server."""
        rpc: Any = distributed.core.rpc
        async with asyncio.timeout(CONNECT_S), rpc(scheduler) as other:
            kind = (await other.identity())["type"]
        if kind != "Scheduler":
            raise ValueError(f"this is a {kind.lower()}'s address")

    connect: Any = distributed.Client
    no_limit = {"distributed.admin.large-graph-warning-threshold": "1TB"}
    with ExitStack() as stack:
        for name in ("asyncio", "distributed", "distributed.client"):  # failures become errors
            logger = logging.getLogger(name)
            stack.callback(logger.setLevel, logger.level)
            logger.setLevel(logging.CRITICAL + 1)
        stack.enter_context(dask.config.set(no_limit))
        try:
            asyncio.run(check_scheduler())
            client = stack.enter_context(
                connect(scheduler, timeout=CONNECT_S, set_as_default=False)
            )
        except Exception as error:  # Dask raises almost anything
            why = _first_line(error) or f"no answer within {CONNECT_S:g} s"
            raise EngineError(f"{scheduler}: no Dask scheduler answers: {why}") from error
        yield _ClusterWorkers(client, scheduler)


class _ClusterWorkers(Workers):
    """The workers of a cluster, counted at most every `POLL_S` seconds."""

    def __init__(self, client: Any, scheduler: str) -> None:
        super().__init__(client.get_executor(pure=False), 1)
        self._client, self._scheduler, self._counted = client, scheduler, -POLL_S

    def count(self) -> int:
        if time.monotonic() - self._counted >= POLL_S:
            self.check()
        return self._workers

    def check(self) -> None:
        """Count the workers; raise EngineError if the scheduler is lost."""
        self._counted = time.monotonic()
        try:
            with suppress(TimeoutError):  # of a scheduler that hangs
                ask = self._client.scheduler.ncores
                cores = self._client.sync(ask, callback_timeout=CONNECT_S)
                self._workers = max(1, len(cores))
        except Exception as error:
            raise EngineError(f"{self._scheduler}: {_LOST}") from error
        if self._client.status != "running":
            raise EngineError(f"{self._scheduler}: {_LOST}")

    def explain(self, error: Exception) -> str | None:
        from distributed import KilledWorker  # noqa: PLC0415

        why = ""
        if isinstance(error, KilledWorker):
            why = _KILLED
        elif isinstance(error, CancelledError) or self._client.status != "running":
            why = _LOST
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, ImportError) and (cause.name or "").startswith("fpmatch"):
                why = f"a worker cannot import fpmatch {__version__}: {_first_line(cause)}"
            cause = cause.__cause__
        return f"{self._scheduler}: {why}" if why else None


def _first_line(error: BaseException) -> str:
    """Return the first line of the message of an error, "" where it has none."""
    return next(iter(str(error).splitlines()), "")
