"""One interface to the places where the work of a whole batch may be done.

An engine is one of three: this process (`here`), all cores of this machine (`cores`), or a Dask
cluster that somebody else has started (`dask`). Whichever it is, the results come in the order of
the work and are the same to the last bit: an engine decides where a chunk is worked on, never what
comes out of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar

from fpmatch.engine.local import Cores, Here, available_cores

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from types import TracebackType
    from typing import Self

Shared = TypeVar("Shared")
Chunk = TypeVar("Chunk")
Result = TypeVar("Result")


class Engine(Protocol):
    """Do chunks of work somewhere; a context manager that lets go of that place at its end."""

    def map(
        self,
        work: Callable[[Shared, Chunk], Result],
        shared: Shared,
        chunks: Iterable[Chunk],
    ) -> Generator[Result, None, None]:
        """Yield ``work(shared, chunk)`` for each chunk, in order.

        Chunks are drawn as they are needed and only so many results wait to be taken, so that
        neither list needs to fit into memory. Leaving off early (closing the generator) drops
        the work that has not begun.

        Parameters
        ----------
        work : callable
            A function at the top of a module. Several chunks may be worked on at once, but never
            two in one process, where OpenCV and numpy run on one thread meanwhile.
        shared : object
            What all chunks need; sent to each worker once. A worker keeps its copy from chunk to
            chunk, so `work` may leave in it what it does not want to compute twice.
        chunks : iterable
            The pieces of work.

        Raises
        ------
        EngineError
            If the engine broke down. What `work` raises comes through as it is.
        """

    def __enter__(self) -> Self:
        """Take hold of the place."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let go of it."""


def here() -> Engine:
    """Return the engine that works in this process.

    Examples
    --------
    >>> with here() as engine:
    ...     list(engine.map(pow, 2, [1, 2, 3]))
    [2, 4, 8]
    """
    return Here()


def cores(workers: int | None = None) -> Engine:
    """Return the engine of several processes on this machine.

    Worker processes are started afresh, or on Linux forked from one that has only imported modules:
    OpenCV's threads do not survive a fork. They start when there is work for them, and end with it
    or, where somebody has taken hold of the engine, when that one lets go. A script that calls into
    here needs the usual ``if __name__ == "__main__":`` guard.

    Parameters
    ----------
    workers : int, optional
        How many processes (default: one a core); 1 works in this process.

    Raises
    ------
    ValueError
        If `workers` is less than 1.
    """
    count = available_cores() if workers is None else workers
    if count < 1:
        raise ValueError(f"workers must be at least 1, not {count}")
    return Here() if count == 1 else Cores(count)


def dask(scheduler: str) -> Engine:
    """Return the engine of a Dask cluster that is already running.

    Workers may join and may die: what a dead one was working on is done again by another. They
    need the same version of fpmatch, but none of the files.

    Parameters
    ----------
    scheduler : str
        Address of its scheduler, as ``tcp://host:8786``.

    Raises
    ------
    EngineError
        If Dask is not installed (extra ``fpmatch[dask]``); on entering, if no scheduler answers.
    """
    from fpmatch.engine.cluster import Cluster  # noqa: PLC0415

    return Cluster(scheduler)


def make_engine(workers: int | None = None, scheduler: str | None = None) -> Engine:
    """Return the engine that a user asked for.

    Parameters
    ----------
    workers : int, optional
        Processes on this machine (default: one a core).
    scheduler : str, optional
        Address of a Dask scheduler, to work there instead.

    Raises
    ------
    ValueError
        If both are given, or `workers` is less than 1.
    EngineError
        As `dask` does.
    """
    if scheduler is None:
        return cores(workers)
    if workers is not None:
        raise ValueError("workers are those of the scheduler: give one or the other")
    return dask(scheduler)
