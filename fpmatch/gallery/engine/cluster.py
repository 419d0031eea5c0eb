"""The engine of a Dask cluster: workers on any machine, which may join and leave."""

from __future__ import annotations

import asyncio
import logging
import pickle
import threading
import time
import uuid
from collections import OrderedDict
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final, TypeVar

from fpmatch._version import __version__
from fpmatch.errors import EngineError
from fpmatch.gallery.engine.local import CHUNKS_IN_FLIGHT, results_in_order
from fpmatch.gallery.engine.processes import single_threaded

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Generator, Iterable, Iterator
    from typing import Self


Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")

CONNECT_S: Final = 10.0  # time limit for the scheduler to answer
NO_WORKERS_S: Final = 60.0  # time limit for a cluster without workers
POLL_S: Final = 2.0  # interval between counts of the workers
_LOST: Final = "the connection to the scheduler is lost"
KILLED: Final = "the same piece of work has ended several workers; out of memory?"
RUNS_HELD: Final = 2  # runs that a worker keeps, the latest ones


class DaskCluster:
    """Work on the Dask cluster of a scheduler's address, as an `engine.Engine`."""

    def __init__(self, scheduler: str) -> None:
        try:
            import distributed  # noqa: PLC0415
        except ImportError as error:
            raise EngineError(
                "Dask is not installed; a scheduler needs it: pip install 'fpmatch[dask]'"
            ) from error
        self._dask: Any = distributed
        self._scheduler = scheduler
        self._client: Any = None
        self._open = ExitStack()
        self._counted = self._seen = -POLL_S
        self._workers: Collection[str] = ()
        self._entered = 0

    def __enter__(self) -> Self:
        if not self._entered:
            self._connect()
        self._entered += 1
        return self

    def _connect(self) -> None:
        with ExitStack() as stack:
            stack.enter_context(_dask_silenced())
            try:
                asyncio.run(asyncio.wait_for(self._check_scheduler(), CONNECT_S))
                self._client = stack.enter_context(
                    self._dask.Client(self._scheduler, timeout=CONNECT_S, set_as_default=False)
                )
            except Exception as error:  # Dask raises almost anything
                why = first_line(error) or f"no answer within {CONNECT_S:g} s"
                raise self.error(f"no Dask scheduler answers: {why}") from error
            self._open = stack.pop_all()
        self._seen = time.monotonic()

    def __exit__(self, *_: object) -> None:
        self._entered -= 1
        if not self._entered:
            self._open.close()

    async def _check_scheduler(self) -> None:
        """Check that a scheduler answers: a client would wait for ever for another server."""
        async with self._dask.core.rpc(self._scheduler, timeout=CONNECT_S) as other:
            kind = (await other.identity())["type"]
        if kind != "Scheduler":
            raise ValueError(f"this is a {kind.lower()}'s address")

    def map(
        self, work: Callable[[Shared, Chunk], Result], shared: Shared, chunks: Iterable[Chunk]
    ) -> Generator[Result, None, None]:
        """Submit chunks, a few for each worker, and yield their results in order."""
        run = self.start_run(work, shared)
        yield from results_in_order(
            chunks,
            lambda chunk: self.submit(run_chunk, *run, chunk),
            self._result,
            self.most_in_flight,
            self.cancel,
        )

    def start_run(self, work: Callable[..., Any], shared: object) -> tuple[str, Any]:
        """Send what chunks share; return the two arguments of `run_chunk` before a chunk."""
        # In the task graph, not scattered: recomputed if the only worker that held it is lost.
        return uuid.uuid4().hex, self.submit(bytes, pickle.dumps((__version__, work, shared)))

    def submit(self, *call: object, **where: Any) -> Any:
        """Return the future of a call, to be made on one of the workers."""
        import dask  # noqa: PLC0415

        quiet = dask.config.set({"distributed.admin.large-graph-warning-threshold": "1TB"})
        with quiet, self.connected():
            return self._client.submit(*call, pure=False, **where)

    def scatter(self, content: object, worker: str) -> Any:
        """Return the future of an object that is in the memory of a worker."""
        return self._client.scatter([content], workers=[worker], hash=False)[0]

    def cancel(self, waiting: Collection[Any]) -> None:
        """Cancel futures, as far as the scheduler is still there."""
        if waiting and self._client.status == "running":
            with suppress(Exception):  # lost meanwhile
                self._client.cancel(list(waiting), force=True)

    def most_in_flight(self) -> int:
        """Return the number of chunks that are submitted before a result is taken."""
        return CHUNKS_IN_FLIGHT * max(1, len(self.workers()))

    def workers(self, *, now: bool = False) -> Collection[str]:
        """Return the addresses of workers, asked at most every `POLL_S` seconds unless `now`.

        Raises EngineError if the scheduler is lost, or no worker has answered for `NO_WORKERS_S`.
        """
        asked = time.monotonic()
        if now or asked - self._counted >= POLL_S:
            self._counted = asked
            with self.connected(), suppress(TimeoutError):  # of a scheduler that hangs
                if self._client.status != "running":
                    raise OSError("not connected")
                count = self._client.scheduler.ncores
                self._workers = self._client.sync(count, callback_timeout=CONNECT_S).keys()
                self._seen = asked if self._workers else self._seen
            if time.monotonic() - self._seen > NO_WORKERS_S:
                raise self.error(f"no worker has answered for {NO_WORKERS_S:g} seconds")
        return self._workers

    def result(self, future: Any) -> Any:
        """Wait for a result up to `POLL_S`, then raise TimeoutError; errors of the work, too.

        An asyncio.CancelledError is raised for work that is lost with a worker or the scheduler.
        """
        try:
            return future.result(timeout=POLL_S)
        except self._dask.KilledWorker as error:
            raise self.error(KILLED) from error
        except (Exception, asyncio.CancelledError) as error:  # Dask raises almost anything
            if future.status == "error":
                self._check_worker_has_fpmatch(error)
                raise
            if isinstance(error, TimeoutError):
                raise TimeoutError from error
            raise asyncio.CancelledError from error

    def _result(self, future: Any) -> Any:
        """Wait for a result as long as there are workers; errors of the work are passed on."""
        while True:
            try:
                return self.result(future)
            except asyncio.CancelledError as error:
                raise self.error(_LOST) from error
            except TimeoutError:
                if future.status == "error":
                    raise
            self.workers()

    def _check_worker_has_fpmatch(self, error: BaseException) -> None:
        """Raise an EngineError if a worker could not even begin with its work."""
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, ImportError) and (cause.name or "").startswith("fpmatch"):
                why = f"a worker cannot import fpmatch {__version__}: {first_line(cause)}"
                raise self.error(why) from error
            cause = cause.__cause__

    @contextmanager
    def connected(self) -> Iterator[None]:
        """Turn whatever Dask raises when its scheduler is gone into an EngineError."""
        try:
            yield
        except (Exception, asyncio.CancelledError) as error:
            raise self.error(_LOST) from error

    def error(self, why: str) -> EngineError:
        """Return an error about this cluster."""
        return EngineError(f"{self._scheduler}: {why}")


# The runs that this worker knows, by run; one chunk at a time.
_runs: OrderedDict[str, tuple[Callable[[Any, Any], Any], Any]] = OrderedDict()
_one_at_a_time: Final = threading.Lock()


def run_chunk(run: str, task: bytes, chunk: object) -> Any:
    """Work on a chunk on a worker, which unpacks the task of a run once."""
    with _one_at_a_time, single_threaded():
        if run not in _runs:
            version, work, shared = pickle.loads(task)
            if version != __version__:
                raise EngineError(
                    f"a worker has fpmatch {__version__}, not {version}: scores might differ"
                )
            _runs[run] = work, shared
            while len(_runs) > RUNS_HELD:
                _runs.popitem(last=False)
        work, shared = _runs[run]
        return work(shared, chunk)


def first_line(error: BaseException) -> str:
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
