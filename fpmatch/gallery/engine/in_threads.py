"""Threads of this process: for work on shared memory that takes milliseconds.

Python code of one process runs in one thread at a time. Kernels that release the interpreter's
lock run in as many as there are cores.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from fpmatch.base.threads import available_cores

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")


class Threads:
    """Work in `workers` threads (default: one a core), which end with the block of the context.

    Less than one is a ValueError.
    """

    def __init__(self, workers: int | None = None) -> None:
        self._executor = ThreadPoolExecutor(available_cores() if workers is None else workers)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown(cancel_futures=True)

    def map(
        self, work: Callable[[Shared, Chunk], Result], shared: Shared, chunks: Iterable[Chunk]
    ) -> Generator[Result, None, None]:
        """Yield ``work(shared, chunk)`` for each chunk, in order, as an `Engine` does."""
        yield from self._executor.map(partial(work, shared), chunks)
