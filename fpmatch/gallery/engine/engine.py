"""Engines: where the chunks of a batch are worked on.

`serial` works in this process; `make_engine` returns one of several on this machine, or of a Dask
cluster that is already running. With every engine the results come in the
order of the chunks and are the same to the last bit.
"""

from __future__ import annotations

import pickle
import uuid
import warnings
from collections import deque
from concurrent.futures import wait
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeVar

from fpmatch._version import __version__
from fpmatch.base.threads import available_cores
from fpmatch.errors import EngineError
from fpmatch.gallery.engine.executors import POLL_S, open_cluster, open_processes
from fpmatch.gallery.engine.worker import run_chunk, single_threaded

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from concurrent.futures import Future
    from contextlib import AbstractContextManager
    from typing import Self

    from fpmatch.gallery.engine.executors import Workers

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")

CHUNKS_IN_FLIGHT: Final = 4  # of each worker: worked on, waiting, or with a result to be taken
_ONE_PROCESS: Final = (
    "one process works, not several: a function or class is defined in a notebook or in the script "
    "that was started, not in a module"
)


class Engine:
    """Works on chunks; as a context manager it keeps its workers from one `map` to the next.

    What `start` opens are its workers; without it, this process works.
    """

    def __init__(self, start: Callable[[], AbstractContextManager[Workers]] | None = None) -> None:
        self._start = start
        self._workers: Workers | None = None
        self._running = ExitStack()
        self._entered = 0

    def __enter__(self) -> Self:
        """Start the workers, unless they run already, and keep them until the block ends."""
        if self._workers is None and self._start is not None:
            self._workers = self._running.enter_context(self._start())
        self._entered += 1
        return self

    def __exit__(self, *_: object) -> None:
        """Release the workers."""
        self._entered -= 1
        if not self._entered:
            self._stop()

    def _stop(self) -> None:
        self._workers = None
        self._running.close()

    def map(
        self,
        work: Callable[[Shared, Chunk], Result],
        shared: Shared,
        chunks: Iterable[Chunk],
        name: Callable[[Chunk], str] | None = None,
    ) -> Generator[Result, None, None]:
        """Yield ``work(shared, chunk)`` for each chunk, in order.

        Chunks are drawn as they are needed and few results wait to be taken, so that neither list
        needs to fit into memory. Closing the generator cancels the chunks that have not begun.

        `work` is a function at the top of a module; no process works on two chunks at once, and
        OpenCV and numpy are kept on one thread. `shared` is what all chunks need: it is sent with
        each, but a worker unpacks it once, and `work` may cache results in that copy. Work that is
        defined in a notebook or in the script that was started is done in this process, with a
        warning. Raises EngineError if the engine broke down, with the `name` of the chunks that
        were worked on; errors of `work` are passed on.

        Examples
        --------
        >>> list(serial().map(pow, 2, [1, 2, 3]))
        [2, 4, 8]
        """
        packed = b"" if self._start is None else _packed(work, shared)
        if b"__main__" in packed:
            warnings.warn(_ONE_PROCESS, RuntimeWarning, stacklevel=2)
        if not packed or b"__main__" in packed:
            with single_threaded():
                for chunk in chunks:
                    yield work(shared, chunk)
            return
        with self:
            yield from self._map(packed, chunks, name)

    def _map(
        self, packed: bytes, chunks: Iterable[Chunk], name: Callable[[Chunk], str] | None
    ) -> Generator[Any, None, None]:
        """Yield the results of workers."""
        assert self._workers is not None
        workers = self._workers
        pending: deque[tuple[Chunk, Future[Any]]] = deque()

        def first() -> Any:
            while not wait([pending[0][1]], POLL_S).done:
                workers.check()
            result = pending[0][1].result()
            pending.popleft()
            return result

        try:
            for chunk in chunks:
                pending.append((chunk, workers.executor.submit(run_chunk, packed, chunk)))
                if len(pending) >= CHUNKS_IN_FLIGHT * workers.count():
                    yield first()
            while pending:
                yield first()
        except Exception as error:
            why = workers.explain(error)
            if why is None:
                raise
            if name is not None and pending:
                at = [name(chunk) for chunk, _ in list(pending)[: workers.count()]]
                why = f"{why} (at {' or '.join(at)})"
            self._stop()
            raise EngineError(why) from error
        finally:
            for _, future in pending:
                future.cancel()


def _packed(work: Callable[..., Any], shared: object) -> bytes:
    """Return what workers read of a task: a name, the version, a function, what its chunks share.

    Raises EngineError for what no other process can be sent, such as a matcher with a lambda.
    """
    try:
        task = uuid.uuid4().hex, __version__, work, shared
        return pickle.dumps(task, pickle.HIGHEST_PROTOCOL)
    except (AttributeError, TypeError, pickle.PicklingError) as error:
        raise EngineError(
            f"cannot be sent to other processes: {error}; one worker needs none"
        ) from error


def serial() -> Engine:
    """Return the engine that works in this process."""
    return Engine()


def make_engine(workers: int | None = None, scheduler: str | None = None) -> Engine:
    """Return the engine of several processes of this machine, or of a Dask cluster.

    Processes start with the block of the engine as a context manager, or with a `map`, and end with
    it. There are `workers` of them (default: one a core); 1 works in this process.

    With a `scheduler`, the address of a cluster's, as ``tcp://host:8786``, its workers may join and
    leave; what a lost one had is computed again by another. They need the same version of fpmatch,
    but none of the files. On entering, EngineError is raised if Dask is not installed (extra
    ``fpmatch[dask]``), or no scheduler answers.

    Less than one worker, or workers and a scheduler, are a ValueError.
    """
    if scheduler is not None:
        if workers is not None:
            raise ValueError("give workers or a scheduler, not both")
        return Engine(partial(open_cluster, scheduler))
    count = available_cores() if workers is None else workers
    if count < 1:
        raise ValueError(f"workers must be at least 1, not {count}")
    return Engine(None if count == 1 else partial(open_processes, count))
