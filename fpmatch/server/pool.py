"""Pool: worker processes that can be stopped, and a queue in front of them."""

from __future__ import annotations

import asyncio
import json
import logging
import math
import multiprocessing
import os
import queue
from contextlib import AsyncExitStack, asynccontextmanager
from logging.handlers import QueueHandler
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

import anyio
from anyio import to_thread

from fpmatch.errors import FpmatchError
from fpmatch.gallery.engine.worker import init_worker
from fpmatch.server.errors import BUSY, ClientGoneError, RequestError

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable
    from multiprocessing.connection import Connection

    from anyio.abc import TaskGroup
    from fastapi import Request

    from fpmatch.server.settings import Settings

    _Outcome = tuple[Any, Exception | None, list[logging.LogRecord]]

Result = TypeVar("Result")

_START_S: Final = 120.0  # that a process may take to import what it needs


class _Process:
    """A worker process, which does one work after another."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=_do_all, args=(other,))
        self._process.start()
        other.close()
        self.is_alive, self.kill = self._process.is_alive, self._process.kill

    def do(self, work: Callable[..., object], args: tuple[Any, ...]) -> _Outcome:
        """Return the outcome of ``work(*args)``; EOFError or OSError if the process ends."""
        self._pipe.send((work, args))
        return cast("_Outcome", self._pipe.recv())


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
        self._turns = anyio.Semaphore(0)  # as many as there are idle processes
        self._gallery_turns = anyio.Semaphore(settings.workers)
        self._all: set[_Process] = set()
        self._idle: list[_Process] = []
        self._threads = anyio.CapacityLimiter(math.inf)
        self._replacements: TaskGroup | None = None

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Start all processes, so that no request waits for imports; replace those that end."""
        async with anyio.create_task_group() as group:
            try:
                async with anyio.create_task_group() as first:
                    for _ in range(self._workers):
                        first.start_soon(self._start)
                self._replacements = group
                yield
            finally:
                self._replacements = None
                group.cancel_scope.cancel()
                for process in self._all:
                    process.kill()

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
                process = await self._next()
            if waiting.cancelled_caught:
                raise RequestError(BUSY, status=503)
            return await self._done(process, seconds, work, args)

    async def _next(self) -> _Process:
        """Return a process that is idle; those that ended meanwhile are replaced."""
        while True:
            await self._turns.acquire()
            process = self._idle.pop()
            if process.is_alive():
                return process
            self._replace(process)

    async def _done(
        self, process: _Process, seconds: float, work: Callable[..., Result], args: tuple[Any, ...]
    ) -> Result:
        done = False
        try:
            with anyio.fail_after(seconds):
                result, error, records = await to_thread.run_sync(
                    process.do, work, args, abandon_on_cancel=True, limiter=self._threads
                )
            done = True
        except TimeoutError as error:
            late = f"this took longer than {seconds:g} seconds and was stopped"
            raise RequestError(late, status=504) from error
        except (EOFError, OSError) as error:
            ended = "the work could not be done: its process ended"
            raise RequestError(ended, status=500) from error
        finally:
            if done:
                self._idle.append(process)
                self._turns.release()
            else:
                self._replace(process)
        for record in records:
            logging.getLogger(record.name).handle(record)
        if error is not None:
            raise error
        return cast("Result", result)

    def _replace(self, process: _Process) -> None:
        """Kill a process, and start another."""
        process.kill()
        self._all.remove(process)
        if self._replacements is not None:
            self._replacements.start_soon(self._start)

    async def _start(self) -> None:
        """Start a process, which is idle once it can work."""
        process = _Process()
        self._all.add(process)
        try:
            await self._done(process, _START_S, _warm_up, ())
        except RequestError:
            if self._replacements is None:  # the server does not start
                raise
        multiprocessing.active_children()  # which joins those that have ended


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


def _do_all(pipe: Connection) -> None:
    """Do what comes through a pipe, in a worker process; send the result or error, and the log."""
    init_worker()
    # libtiff writes to stderr about damaged files; the response contains the error
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    records = queue.SimpleQueue[logging.LogRecord]()
    logging.getLogger().addHandler(QueueHandler(records))
    while True:
        work, args = pipe.recv()
        result: Any = None
        failure: Exception | None = None
        try:
            result = work(*args)
        except MemoryError:
            failure = FpmatchError("not enough memory")
        except Exception as error:  # noqa: BLE001  (raised in the server)
            failure = error
        pipe.send((result, failure, [records.get() for _ in range(records.qsize())]))


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
