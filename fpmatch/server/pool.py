"""Pool: worker processes that can be stopped, and a queue in front of them."""

from __future__ import annotations

import asyncio
import json
import logging
import math
import os
import queue
import signal
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from logging.handlers import QueueHandler
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

import anyio
from anyio import to_process

from fpmatch.errors import FpmatchError
from fpmatch.gallery.engine.worker import keep_single_threaded
from fpmatch.server.errors import BUSY, ClientGoneError, RequestError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from anyio.abc import TaskGroup
    from fastapi import Request

    from fpmatch.server.settings import Settings

    _Outcome = tuple[Any, Exception | None, list[logging.LogRecord]]

Result = TypeVar("Result")

_START_S: Final = 120.0  # that a process may take to import what it needs


class Pool:
    """Do the work of requests in a few processes, in the order of arrival.

    A process is killed, and replaced, when its client has closed the connection or the work takes
    longer than the limit. Work for which a process had ended before it began is given to another;
    work during which its process ends is not done again: it may be the reason. Requests that need
    the gallery never have the last process.
    """

    def __init__(self, settings: Settings) -> None:
        self._limits = settings.limits
        self._workers = settings.processes
        self._turns = anyio.Semaphore(self._workers)
        self._gallery_turns = anyio.Semaphore(settings.workers)
        self._replacements: TaskGroup | None = None

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Start all processes, so that no request waits for imports; replace those that end."""
        to_process.WORKER_MAX_IDLE_TIME = math.inf  # type: ignore[assignment]
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

    async def run(
        self, request: Request, work: Callable[..., Result], *args: Any, gallery: bool = False
    ) -> Result:
        """Return ``work(*args)``, computed by a worker process; `work` is at the top of a module.

        `gallery` is whether the work needs the gallery. Raises what `work` raises, ClientGoneError
        if the client closes the connection, RequestError if no process is free in time, or
        the work takes too long or ends its process.
        """
        doing = asyncio.ensure_future(self._in_turn(self._limits.seconds, work, *args, of=gallery))
        gone = asyncio.ensure_future(_disconnected(request))
        try:
            await asyncio.wait({doing, gone}, return_when=asyncio.FIRST_COMPLETED)
            if not doing.done():
                raise ClientGoneError
            return doing.result()
        finally:
            doing.cancel()
            gone.cancel()
            with anyio.CancelScope(shield=True):
                await asyncio.gather(doing, gone, return_exceptions=True)

    async def prepare(self, work: Callable[..., object], *args: Any) -> None:
        """Do work on the gallery that no request waits for, however long it takes."""
        await self._in_turn(math.inf, work, *args, of=True)

    async def answer(self) -> None:
        """Return when a process answers; at once while all have work, which ends in time."""
        if self._turns.value > 0:
            await self._in_turn(_START_S, os.getpid)

    async def _in_turn(
        self, seconds: float, work: Callable[..., Result], *args: Any, of: bool = False
    ) -> Result:
        """Return ``work(*args)``, after a turn among all, or among those `of` the gallery."""
        async with AsyncExitStack() as entered:
            with anyio.move_on_after(self._limits.wait_seconds) as waiting:
                if of:
                    await entered.enter_async_context(self._gallery_turns)
                await entered.enter_async_context(self._turns)
            if waiting.cancelled_caught:
                raise RequestError(BUSY, status=503)
            return await self._done(seconds, work, args)

    async def _done(
        self, seconds: float, work: Callable[..., Result], args: tuple[Any, ...]
    ) -> Result:
        done = False
        try:
            with anyio.fail_after(seconds):
                result, error, records = await self._in_living_process(work, args)
            done = True
        except TimeoutError as error:
            late = f"this took longer than {seconds:g} seconds and was stopped"
            raise RequestError(late, status=504) from error
        except anyio.BrokenWorkerProcess as error:
            ended = "the work could not be done: its process ended"
            raise RequestError(ended, status=500) from error
        finally:
            if not done:
                self._replace()
        for record in records:
            logging.getLogger(record.name).handle(record)
        if error is not None:
            raise error
        return cast("Result", result)

    async def _in_living_process(
        self, work: Callable[..., Result], args: tuple[Any, ...]
    ) -> _Outcome:
        """Return the outcome of ``work(*args)``; processes that ended without work are replaced."""
        free = anyio.CapacityLimiter(1)  # this pool has limited the call already
        for attempt in range(self._workers + 1):
            try:
                # anyio forgets a process whose start is cancelled
                with anyio.CancelScope(shield=True):
                    await to_process.run_sync(os.getpid, limiter=free)
                return await to_process.run_sync(
                    _in_worker, work, args, cancellable=True, limiter=free
                )
            except anyio.BrokenWorkerProcess as error:
                # what cannot be sent to a process has not been begun
                unsent = isinstance(error.__cause__, anyio.BrokenResourceError)
                if not unsent or attempt == self._workers:
                    raise
                self._replace()
        raise AssertionError

    def _replace(self) -> None:
        """Start a process in place of one that ended."""
        if self._replacements is not None:
            self._replacements.start_soon(self._warm)

    async def _warm(self) -> None:
        # anyio may kill one that ends meanwhile
        with suppress(RequestError, ProcessLookupError):
            await self._in_turn(_START_S, _warm_up)


async def _disconnected(request: Request) -> None:
    """Return when the client has closed the connection."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


def encoded(work: Callable[..., dict[str, Any]], *args: Any) -> bytes:
    """Return the JSON of ``work(*args)``.

    A worker process encodes documents with pictures, so that the server holds them once.
    """
    document = work(*args)
    content = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return content.encode()


_records: queue.SimpleQueue[logging.LogRecord] | None = None  # of this worker process


def _in_worker(work: Callable[..., Any], args: tuple[Any, ...]) -> _Outcome:
    """Call `work` in a worker process; return its result, or its error, and its log."""
    global _records  # noqa: PLW0603
    if _records is None:
        _records = queue.SimpleQueue()
        logging.getLogger().addHandler(QueueHandler(_records))
        # a service manager sends SIGTERM to all processes of the server, which ends this one later
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        # libtiff writes to stderr about damaged files; the response contains the error
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 2)
        os.close(silent)
        keep_single_threaded()
    result: Any = None
    failure: Exception | None = None
    try:
        result = work(*args)
    except MemoryError:
        failure = FpmatchError("not enough memory")
    except Exception as error:  # noqa: BLE001  (raised in the server)
        failure = error
    return result, failure, [_records.get() for _ in range(_records.qsize())]


def _warm_up() -> None:
    """Import what requests need, and extract, grade and compare once."""
    import numpy as np  # noqa: PLC0415

    import fpmatch.server.gallery  # noqa: PLC0415
    import fpmatch.server.pair  # noqa: F401, PLC0415
    from fpmatch.image.extract import assess  # noqa: PLC0415
    from fpmatch.matching.verify import verify  # noqa: PLC0415

    y, x = np.mgrid[:200, :200]
    rings = 127 + 100 * np.cos(2 * np.pi / 9 * np.hypot(x - 100, y - 120))
    template = assess(rings.astype(np.uint8), 500).template
    verify(template, template)
