"""A window of pending results: chunks are submitted before the results of others are taken."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, TypeVar

from fpmatch.errors import EngineError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Generator, Iterable

Chunk = TypeVar("Chunk")
Pending = TypeVar("Pending")
Result = TypeVar("Result")


def results_in_order(
    chunks: Iterable[Chunk],
    submit: Callable[[Chunk], Pending],
    result: Callable[[Pending], Result],
    most_pending: Callable[[], int],
    cancel: Callable[[Collection[Pending]], object] = lambda _: None,
) -> Generator[Result, None, None]:
    """Submit chunks and yield their results in order; `most_pending` are submitted at a time.

    Those whose results were not taken when the generator is closed or an error is raised are
    cancelled, but for an EngineError, after which nothing is left that would work on them.
    """
    pending: deque[Pending] = deque()
    try:
        for chunk in chunks:
            pending.append(submit(chunk))
            if len(pending) >= most_pending():
                yield result(pending.popleft())
        while pending:
            yield result(pending.popleft())
    except EngineError:
        pending.clear()
        raise
    finally:
        cancel(pending)
