"""The engine of a Dask cluster: workers on any machine, which may join and may die."""

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
    from types import TracebackType
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")

CONNECT_S: Final = 10.0  # that a scheduler may take to answer
NO_WORKERS_S: Final = 60.0  # that a cluster may be without a worker before we give up
LOOK_AGAIN_S: Final = 2.0  # between looks at how many workers there are
RUNS_HELD: Final = 2  # in a worker, of the runs it was last asked for


class Cluster:
    """Work on a Dask cluster; see `fpmatch.engine.engine.Engine`.

    Parameters
    ----------
    scheduler : str
        Address of its scheduler.
    """

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
        self._looked = self._seen = -LOOK_AGAIN_S
        self._workers = 0

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            stack.enter_context(_dask_silenced())
            try:
                asyncio.run(asyncio.wait_for(self._meet_scheduler(), CONNECT_S))
                self._client = stack.enter_context(
                    self._dask.Client(self._scheduler, timeout=CONNECT_S, set_as_default=False)
                )
            except (OSError, ValueError, TypeError) as error:
                raise EngineError(
                    f"{self._scheduler}: no Dask scheduler answers: {_why(error)}"
                ) from error
            self._open = stack.pop_all()
        self._seen = time.monotonic()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._open.close()

    async def _meet_scheduler(self) -> None:
        """See who is there: a client would wait for ever on a port where somebody else listens."""
        async with self._dask.core.rpc(self._scheduler, timeout=CONNECT_S) as other:
            kind = (await other.identity())["type"]
        if kind != "Scheduler":
            raise ValueError(f"this is a {kind.lower()}'s address")

    def map(
        self,
        work: Callable[[Shared, Chunk], Result],
        shared: Shared,
        chunks: Iterable[Chunk],
    ) -> Generator[Result, None, None]:
        """Hand out chunks, a few for each worker there is, and their results in order."""
        run = uuid.uuid4().hex
        # In the task graph, not scattered: what only a dead worker held is then computed anew.
        held = self._submit(bytes, pickle.dumps((__version__, work, shared)))
        waiting: deque[Any] = deque()
        try:
            for chunk in chunks:
                waiting.append(self._submit(_work_on, run, held, chunk))
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
        """Return how many workers there are, as of a moment ago."""
        now = time.monotonic()
        if now - self._looked >= LOOK_AGAIN_S:
            with self._in_our_words():
                self._workers = len(self._client.nthreads())
            self._looked = now
        if self._workers:
            self._seen = now
        return self._workers

    def _result(self, future: Any) -> Any:
        """Wait for a result as long as there is somebody to work on it."""
        while True:
            with self._in_our_words():
                try:
                    return future.result(timeout=LOOK_AGAIN_S)
                except TimeoutError:
                    if future.status == "error":  # it is the work that raises this
                        raise
            self._count_workers()
            if time.monotonic() - self._seen > NO_WORKERS_S:
                raise EngineError(
                    f"{self._scheduler}: no worker has been there for {NO_WORKERS_S:g} seconds"
                )

    @contextmanager
    def _in_our_words(self) -> Iterator[None]:
        try:
            yield
        except self._dask.KilledWorker as error:
            raise EngineError(
                f"{self._scheduler}: the same piece of work has ended several workers; "
                "out of memory?"
            ) from error
        except (asyncio.CancelledError, self._dask.comm.CommClosedError) as error:
            raise EngineError(f"{self._scheduler}: the connection is lost") from error


# What this worker was told of the runs at hand, by run; one chunk at a time works with it.
_held: OrderedDict[str, tuple[Callable[[Any, Any], Any], Any]] = OrderedDict()
_one_at_a_time: Final = threading.Lock()


def _work_on(run: str, told: bytes, chunk: object) -> Any:
    with _one_at_a_time, single_threaded():
        if run not in _held:
            _held[run] = _understand(told)
            while len(_held) > RUNS_HELD:
                _held.popitem(last=False)
        work, shared = _held[run]
        return work(shared, chunk)


def _understand(told: bytes) -> tuple[Callable[[Any, Any], Any], Any]:
    version, work, shared = pickle.loads(told)
    if version != __version__:
        raise EngineError(f"a worker has fpmatch {__version__}, not {version}: scores might differ")
    return work, shared


@contextmanager
def _dask_silenced() -> Iterator[None]:
    """Keep Dask from logging what ends in an error of ours."""
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


def _why(error: BaseException) -> str:
    """Return the first line of what is wrong."""
    lines = str(error).splitlines()
    return lines[0] if lines else f"no answer within {CONNECT_S:g} s"
