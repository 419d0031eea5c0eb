"""Engines: where the chunks of a batch are worked on.

`serial` works in this process, `processes` in several on this machine, `dask` on a cluster that is
already running. With every engine the results come in the order of the chunks and are the same to
the last bit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar

from fpmatch.base.threads import available_cores
from fpmatch.gallery.engine.local import Processes, Serial

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")


class Engine(Protocol):
    """Works on chunks; as a context manager it keeps its workers from one `map` to the next."""

    def map(
        self, work: Callable[[Shared, Chunk], Result], shared: Shared, chunks: Iterable[Chunk]
    ) -> Generator[Result, None, None]:
        """Yield ``work(shared, chunk)`` for each chunk, in order.

        Chunks are drawn as they are needed and few results wait to be taken, so that neither list
        needs to fit into memory. Closing the generator cancels the chunks that have not begun.

        `work` is a function at the top of a module; no process works on two chunks at once, and
        OpenCV and numpy are kept on one thread. `shared` is what all chunks need: it is sent to
        each worker once, and `work` may cache results in that copy. Raises EngineError if the
        engine broke down; errors of `work` are passed on.
        """

    def __enter__(self) -> Self:
        """Keep the workers until the block ends."""

    def __exit__(self, *_: object) -> None:
        """Release the workers."""


def serial() -> Engine:
    """Return the engine that works in this process.

    Examples
    --------
    >>> with serial() as engine:
    ...     list(engine.map(pow, 2, [1, 2, 3]))
    [2, 4, 8]
    """
    return Serial()


def processes(workers: int | None = None) -> Engine:
    """Return the engine of several processes on this machine.

    They start with the first chunk and end with the `map`, or with the block of the engine as a
    context manager. They are spawned, or on Linux forked from a process that has only imported
    modules, because OpenCV's threads do not survive a fork. Work that is defined in a notebook, or
    in a script without the usual ``if __name__ == "__main__":``, is done in this process, with a
    warning. There are `workers` of them (default: one a core); 1 works in this process, and less
    is a ValueError.
    """
    count = available_cores() if workers is None else workers
    if count < 1:
        raise ValueError(f"workers must be at least 1, not {count}")
    return Serial() if count == 1 else Processes(count)


def dask(scheduler: str) -> Engine:
    """Return the engine of a Dask cluster that is already running.

    `scheduler` is its address, as ``tcp://host:8786``. Workers may join and leave; what a lost
    worker had is computed again by another. They need the same version of fpmatch, but none of the
    files. Raises EngineError if Dask is not installed (extra ``fpmatch[dask]``), and on entering,
    if no scheduler answers.
    """
    from fpmatch.gallery.engine.cluster import DaskCluster  # noqa: PLC0415

    return DaskCluster(scheduler)


def make_engine(workers: int | None = None, scheduler: str | None = None) -> Engine:
    """Return `dask` of the scheduler if there is one, else `processes`; ValueError for both."""
    if scheduler is None:
        return processes(workers)
    if workers is not None:
        raise ValueError("give workers or a scheduler, not both")
    return dask(scheduler)
