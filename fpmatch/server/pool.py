"""Pool: worker processes that can be stopped, and a queue in front of them."""

from __future__ import annotations

import json
import os
import signal
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any, Final, TypeVar

import anyio
from anyio import to_process

from fpmatch.errors import FpmatchError
from fpmatch.gallery.engine.processes import keep_single_threaded
from fpmatch.server.errors import ClientGoneError, TooLongError, WorkerError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from anyio.abc import TaskGroup
    from fastapi import Request

Result = TypeVar("Result")

_START_S: Final = 120.0  # that a process may take to import what it needs


class Pool:
    """Do the work of requests in a few processes, in the order of arrival.

    A process is killed, and replaced, when its client has closed the connection or the work takes
    longer than `seconds`. Work for which a process had ended before it began is given to another;
    work during which its process ends is not done again: it may be the reason. Only the prepared
    gallery is kept from one request to the next.
    """

    def __init__(self, workers: int, seconds: float) -> None:
        self._workers = workers
        self._seconds = seconds
        self._turns = anyio.CapacityLimiter(workers)
        self._replacements: TaskGroup | None = None

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Start all processes, so that no request waits for imports; replace those that end."""
        async with anyio.create_task_group() as group:
            async with anyio.create_task_group() as first:
                for _ in range(self._workers):
                    first.start_soon(self._in_turn, _START_S, _warm_up)
            self._replacements = group
            try:
                yield
            finally:
                self._replacements = None
                group.cancel_scope.cancel()

    async def run(self, request: Request, work: Callable[..., Result], *args: Any) -> Result:
        """Return ``work(*args)``, computed by a worker process; `work` is at the top of a module.

        Raises what `work` raises, ClientGoneError if the client closes the connection, TooLongError
        or WorkerError if the work takes too long or ends its process.
        """
        outcome: list[Result] = []
        failure: list[Exception] = []
        async with anyio.create_task_group() as group:

            async def watch() -> None:
                while (await request.receive())["type"] != "http.disconnect":
                    pass
                group.cancel_scope.cancel()

            group.start_soon(watch)
            try:
                outcome.append(await self._in_turn(self._seconds, work, *args))
            except Exception as error:  # noqa: BLE001  (raised below, out of the task group)
                failure.append(error)
            group.cancel_scope.cancel()
        if failure:
            raise failure[0]
        if not outcome:
            raise ClientGoneError
        return outcome[0]

    async def answer(self) -> None:
        """Return when a process answers; at once while all have work, which ends in time."""
        if self._turns.available_tokens > 0:
            await self._in_turn(_START_S, os.getpid)

    async def _in_turn(self, seconds: float, work: Callable[..., Result], *args: Any) -> Result:
        async with self._turns:
            done = False
            try:
                with anyio.fail_after(seconds):
                    result = await self._in_living_process(work, args)
                done = True
            except TimeoutError as error:
                late = f"this took longer than {seconds:g} seconds and was stopped"
                raise TooLongError(late, status=504) from error
            except anyio.BrokenWorkerProcess as error:
                ended = "the work could not be done: its process ended"
                raise WorkerError(ended, status=500) from error
            except FpmatchError:
                done = True
                raise
            finally:
                if not done and self._replacements is not None:
                    self._replacements.start_soon(self._replace)
            return result

    async def _in_living_process(
        self, work: Callable[..., Result], args: tuple[Any, ...]
    ) -> Result:
        """Return ``work(*args)``; processes that ended without work are replaced."""
        free = anyio.CapacityLimiter(1)  # this pool has limited the call already
        for _ in range(self._workers):
            try:
                return await to_process.run_sync(
                    _on_one_thread, work, args, cancellable=True, limiter=free
                )
            except anyio.BrokenWorkerProcess as error:
                # what cannot be sent to a process has not been begun
                if not isinstance(error.__cause__, anyio.BrokenResourceError):
                    raise
                if self._replacements is not None:
                    self._replacements.start_soon(self._replace)
        return await to_process.run_sync(_on_one_thread, work, args, cancellable=True, limiter=free)

    async def _replace(self) -> None:
        """Start a process in place of one that ended; anyio may kill one that ends meanwhile."""
        with suppress(TooLongError, WorkerError, ProcessLookupError):
            await self._in_turn(_START_S, _warm_up)


def encoded(work: Callable[..., dict[str, Any]], *args: Any) -> bytes:
    """Return the JSON of ``work(*args)``.

    A worker process encodes documents with pictures, so that the server holds them once.
    """
    document = work(*args)
    content = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return content.encode()


_ready: list[bool] = []  # whether this worker process is on one thread


def _on_one_thread(work: Callable[..., Result], args: tuple[Any, ...]) -> Result:
    """Call `work` in a worker process, silent and on one thread."""
    if not _ready:
        # a service manager sends SIGTERM to all processes of the server, which ends this one later
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        # libtiff writes to stderr about damaged files; the response contains the error
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        keep_single_threaded()
        _ready.append(True)
    try:
        return work(*args)
    except MemoryError as error:
        raise FpmatchError("not enough memory") from error


def _warm_up() -> None:
    """Import what requests need, and extract, grade and compare once."""
    import numpy as np  # noqa: PLC0415

    import fpmatch.server.gallery  # noqa: PLC0415
    import fpmatch.server.pair  # noqa: PLC0415
    import fpmatch.server.single  # noqa: F401, PLC0415
    from fpmatch.image.extract import assess  # noqa: PLC0415
    from fpmatch.matching.verify import verify  # noqa: PLC0415

    y, x = np.mgrid[:200, :200]
    rings = 127 + 100 * np.cos(2 * np.pi / 9 * np.hypot(x - 100, y - 120))
    template = assess(rings.astype(np.uint8), 500).template
    verify(template, template)
