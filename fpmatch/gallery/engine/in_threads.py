"""Threads of this process: for work on shared memory that takes milliseconds.

Python code of one process runs in one thread at a time. Kernels that release the interpreter's
lock run in as many as there are cores.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from fpmatch.base.threads import available_cores
from fpmatch.gallery.engine.executors import in_order

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")


class Threads:
    """Work in `workers` threads (default: one a core), which end with the block of the context.

    With one, or for one chunk, the caller's thread works. Less than one is a ValueError.
    """

    def __init__(self, workers: int | None = None) -> None:
        if workers is not None and workers < 1:
            raise ValueError(f"workers must be at least 1, not {workers}")
        self._workers = workers or available_cores()
        self._executor = ThreadPoolExecutor(self._workers)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown(cancel_futures=True)

    def map(
        self, work: Callable[[Shared, Chunk], Result], shared: Shared, chunks: Iterable[Chunk]
    ) -> Generator[Result, None, None]:
        """Yield ``work(shared, chunk)`` for each chunk, in order, as an `Engine` does.

        Examples
        --------
        >>> with Threads(2) as threads:
        ...     list(threads.map(pow, 2, [1, 2, 3]))
        [2, 4, 8]
        """
        given, call = list(chunks), partial(work, shared)
        if self._workers == 1 or len(given) < 2:
            yield from map(call, given)
            return
        submit = partial(self._executor.submit, call)
        yield from in_order(submit, given, lambda: len(given) + 1)
