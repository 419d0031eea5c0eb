"""Threads of this process: for work on shared memory that takes milliseconds.

Python code of one process runs in one thread at a time. Kernels that release the interpreter's
lock run in as many as there are cores.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, TypeVar

from fpmatch.base.threads import available_cores

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from concurrent.futures import Future, ThreadPoolExecutor
    from typing import Self

Item = TypeVar("Item")
Result = TypeVar("Result")


class Threads:
    """Call functions in `workers` threads, of which the caller's is one.

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

    def map(self, work: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
        """Return ``[work(item) for item in items]``.

        After an error or Ctrl-C no item is begun; the block of the context manager ends when those
        are done that were begun before.

        Examples
        --------
        >>> with Threads(2) as threads:
        ...     threads.map(abs, [-1, 2, -3])
        [1, 2, 3]
        """
        pending = deque(enumerate(items))
        results: dict[int, Result] = {}

        def work_on_pending() -> None:
            try:
                while (one := _next(pending)) is not None:
                    results[one[0]] = work(one[1])
            finally:
                pending.clear()

        try:
            begun = [self._start(work_on_pending) for _ in range(self._helpers(len(pending)))]
            work_on_pending()
            for helper in begun:
                helper.result()
        finally:
            pending.clear()
        return [results[k] for k in range(len(results))]

    def _helpers(self, items: int) -> int:
        """Return how many threads help the caller's with so many items."""
        if items < 2 or self._workers == 1:
            return 0
        return min(self._workers or available_cores(), items) - 1

    def _start(self, work: Callable[[], None]) -> Future[None]:
        if self._executor is None:
            from concurrent.futures import ThreadPoolExecutor  # noqa: PLC0415  (seldom needed)

            self._executor = ThreadPoolExecutor(self._workers or available_cores())
        return self._executor.submit(work)


def _next(pending: deque[tuple[int, Item]]) -> tuple[int, Item] | None:
    """Return the next item, which no other thread gets; None if there is none."""
    try:
        return pending.popleft()
    except IndexError:
        return None
