"""The engine of a Dask cluster: workers on any machine, which may join and leave."""

from __future__ import annotations

import asyncio
import logging
import pickle
import threading
import time
import uuid
from collections import OrderedDict, deque
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Final, TypeVar

from fpmatch._version import __version__
from fpmatch.engine.local import CHUNKS_IN_FLIGHT
from fpmatch.engine.threads import single_threaded
from fpmatch.errors import EngineError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")

CONNECT_S: Final = 10.0  # time limit for the scheduler to answer
NO_WORKERS_S: Final = 60.0  # time limit for a cluster without workers
POLL_S: Final = 2.0  # interval between counts of the workers
RUNS_HELD: Final = 2  # runs that a worker keeps, the latest ones


class DaskCluster:
    """Work on the Dask cluster of a scheduler's address; see `fpmatch.engine.engine.Engine`."""

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
        self._workers = 0

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            stack.enter_context(_dask_silenced())
            try:
                asyncio.run(asyncio.wait_for(self._check_scheduler(), CONNECT_S))
                self._client = stack.enter_context(
                    self._dask.Client(self._scheduler, timeout=CONNECT_S, set_as_default=False)
                )
            except (OSError, ValueError, TypeError) as error:
                lines = str(error).splitlines() or [f"no answer within {CONNECT_S:g} s"]
                raise EngineError(
                    f"{self._scheduler}: no Dask scheduler answers: {lines[0]}"
                ) from error
            self._open = stack.pop_all()
        self._seen = time.monotonic()
        return self

    def __exit__(self, *_: object) -> None:
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
        run = uuid.uuid4().hex
        # In the task graph, not scattered: recomputed if the only worker that held it is lost.
        held = self._submit(bytes, pickle.dumps((__version__, work, shared)))
        waiting: deque[Any] = deque()
        try:
            for chunk in chunks:
                waiting.append(self._submit(_run_chunk, run, held, chunk))
                if len(waiting) >= CHUNKS_IN_FLIGHT * max(1, self._count_workers()):
                    yield self._result(waiting.popleft())
            while waiting:
                yield self._result(waiting.popleft())
        finally:
            if waiting and self._client.status == "running":
                self._client.cancel(list(waiting), force=True)

    def _submit(self, *call: object) -> Any:
        import dask  # noqa: PLC0415

        with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1TB"}):
            return self._client.submit(*call, pure=False)

    def _count_workers(self) -> int:
        """Return how many workers there are, counted at most every `POLL_S` seconds."""
        now = time.monotonic()
        if now - self._counted >= POLL_S:
            with self._as_engine_errors():
                self._workers = len(self._client.nthreads())
            self._counted = now
        if self._workers:
            self._seen = now
        return self._workers

    def _result(self, future: Any) -> Any:
        """Wait for a result as long as there are workers."""
        while True:
            with self._as_engine_errors():
                try:
                    return future.result(timeout=POLL_S)
                except TimeoutError:
                    if future.status == "error":  # raised by the work itself
                        raise
            self._count_workers()
            if time.monotonic() - self._seen > NO_WORKERS_S:
                raise EngineError(
                    f"{self._scheduler}: no worker has answered for {NO_WORKERS_S:g} seconds"
                )

    @contextmanager
    def _as_engine_errors(self) -> Iterator[None]:
        try:
            yield
        except self._dask.KilledWorker as error:
            raise EngineError(
                f"{self._scheduler}: the same piece of work has ended several workers; "
                "out of memory?"
            ) from error
        except (asyncio.CancelledError, self._dask.comm.CommClosedError) as error:
            raise EngineError(f"{self._scheduler}: the connection is lost") from error


# The runs that this worker knows, by run; one chunk at a time.
_runs: OrderedDict[str, tuple[Callable[[Any, Any], Any], Any]] = OrderedDict()
_one_at_a_time: Final = threading.Lock()


def _run_chunk(run: str, task: bytes, chunk: object) -> Any:
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
