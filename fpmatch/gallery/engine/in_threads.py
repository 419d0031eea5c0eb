"""Threads of this process: for work on shared memory that takes milliseconds.

Python code of one process runs in one thread at a time. Kernels that release the interpreter's
lock run in as many as there are cores.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, TypeVar

from fpmatch.base.threads import available_cores

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from concurrent.futures import Future, ThreadPoolExecutor
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")


class Threads:
    """Work in `workers` threads of this process, of which the caller's is one.

    The others start when they are needed first, and end with the block of the context manager. The
    default is one thread a core; less than 1 is a ValueError.
    """

    def __init__(self, workers: int | None = None) -> None:
        if workers is not None and workers < 1:
            raise ValueError(f"workers must be at least 1, not {workers}")
        self._workers = workers
        self._executor: ThreadPoolExecutor | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        executor, self._executor = self._executor, None
        if executor is not None:
            executor.shutdown()

    def map(
        self, work: Callable[[Shared, Chunk], Result], shared: Shared, chunks: Iterable[Chunk]
    ) -> Generator[Result, None, None]:
        """Yield ``work(shared, chunk)`` for each chunk, in order, once all are done.

        It is as that of an `fpmatch.gallery.engine.engine.Engine`, but all chunks are drawn at
        first. After an error or Ctrl-C no chunk is begun; the block of the context manager ends
        when those are done that were begun before.

        Examples
        --------
        >>> with Threads(2) as threads:
        ...     list(threads.map(pow, 2, [1, 2, 3]))
        [2, 4, 8]
        """
        pending = deque(enumerate(chunks))
        results: dict[int, Result] = {}

        def work_on_pending() -> None:
            try:
                while (one := _next(pending)) is not None:
                    results[one[0]] = work(shared, one[1])
            finally:
                pending.clear()

        try:
            begun = [self._start(work_on_pending) for _ in range(self._helpers(len(pending)))]
            work_on_pending()
            for helper in begun:
                helper.result()
        finally:
            pending.clear()
        yield from (results[k] for k in range(len(results)))

    def _helpers(self, chunks: int) -> int:
        """Return how many threads help the caller's with so many chunks."""
        if chunks < 2 or self._workers == 1:
            return 0
        return min(self._workers or available_cores(), chunks) - 1

    def _start(self, work: Callable[[], None]) -> Future[None]:
        if self._executor is None:
            from concurrent.futures import ThreadPoolExecutor  # noqa: PLC0415  (seldom needed)

            self._executor = ThreadPoolExecutor(self._workers or available_cores())
        return self._executor.submit(work)


def _next(pending: deque[tuple[int, Chunk]]) -> tuple[int, Chunk] | None:
    """Return the next chunk, which no other thread gets; None if there is none."""
    try:
        return pending.popleft()
    except IndexError:
        return None
