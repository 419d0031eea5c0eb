"""Watch: the log and the measurements of a server, and checks of what requests need."""

from __future__ import annotations

import asyncio
import logging
import sys
import time
from typing import TYPE_CHECKING, Any, Final

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector

from fpmatch.errors import FpmatchError
from fpmatch.server.errors import NotReadyError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from starlette.types import Message, Receive, Scope, Send

    from fpmatch.server.access import Access

CHECK_S: Final = 1.5  # that a check may take: whoever asks is answered within two seconds
KEPT_S: Final = 1.0  # that its outcome is told without another check
_SECONDS: Final = (0.01, 0.03, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0)
_access_log: Final = logging.getLogger("fpmatch.access")


class Observer:
    """Measure and log every request."""

    def __init__(self, access: Access) -> None:
        self._app = access
        self.registry = registry = CollectorRegistry()
        ProcessCollector(registry=registry)
        self._requests = Counter(
            "fpmatch_requests", "Requests answered", ["route", "status"], registry=registry
        )
        self._seconds = Histogram(
            "fpmatch_request_seconds",
            "Time from the arrival of a request to the end of its response",
            ["route"],
            buckets=_SECONDS,
            registry=registry,
        )
        inside = Gauge("fpmatch_requests_inside", "Requests worked on", registry=registry)
        inside.set_function(lambda: access.inside)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass one request on, then account for it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        start, status, method = time.perf_counter(), 500, scope["method"]
        if method == "HEAD":  # answered as GET: web servers leave out the body
            scope = {**scope, "method": "GET"}

        async def sending(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        scope["fpmatch.registry"] = self.registry
        try:
            await self._app(scope, receive, sending)
        finally:
            self._account(scope, method, status, time.perf_counter() - start)

    def _account(self, scope: Scope, method: str, status: int, seconds: float) -> None:
        route, client = route_of(scope), scope.get("fpmatch.client")
        self._requests.labels(route, status).inc()
        self._seconds.labels(route).observe(seconds)
        fields = {
            "address": (scope.get("client") or ("-",))[0],
            "client": "-" if client is None else client.name,
            "method": method,
            "route": route,
            "status": status,
            "seconds": round(seconds, 4),
        }
        _access_log.info("%s %s %s %s %d %.3f s", *fields.values(), extra=fields)


def route_of(scope: Scope) -> str:
    """Return the address of the API that a request is for."""
    return getattr(scope.get("route"), "path", "other")


def set_up_logging(form: str, stream: Any = None) -> None:
    """Let this process write its log to a stream (default: stderr), a line an event.

    The form is "none" (warnings and errors only, as text), "text" or "json".
    """
    handler = logging.StreamHandler(stream or sys.stderr)
    words = "%(asctime)s %(levelname)s %(name)s %(message)s"
    if form == "json":
        from pythonjsonlogger.json import JsonFormatter  # noqa: PLC0415

        handler.setFormatter(JsonFormatter(words, timestamp="time"))
    else:
        handler.setFormatter(logging.Formatter(words))
    root = logging.getLogger()
    for former in root.handlers[:1]:
        root.removeHandler(former)
    root.addHandler(handler)
    root.setLevel(logging.WARNING)
    _access_log.setLevel(logging.WARNING if form == "none" else logging.INFO)


class Check:
    """Find out whether something works; `what` is its name in the error where it is silent.

    There is one check at a time. While one goes on for too long, there is no other, and whoever
    asks is told so at once.
    """

    def __init__(self, what: str, look: Callable[[], Awaitable[object]]) -> None:
        self._look = look
        why = f"{what} has not answered within {CHECK_S:g} seconds"
        self._silent = NotReadyError(why, code="late")
        self._task: asyncio.Task[FpmatchError | None] | None = None
        self._began = self._ended = 0.0

    async def fault(self) -> FpmatchError | None:
        """Return what is wrong, with code "late" where there is no answer; None if nothing is."""
        task = self._task
        if task is None or (task.done() and time.monotonic() - self._ended >= KEPT_S):
            self._began = time.monotonic()
            self._task = task = asyncio.create_task(self._outcome())
        left = self._began + CHECK_S - time.monotonic()
        done, _ = await asyncio.wait([task], timeout=max(0.0, left))
        return task.result() if done else self._silent

    async def _outcome(self) -> FpmatchError | None:
        try:
            await self._look()
        except FpmatchError as error:
            return error
        finally:
            self._ended = time.monotonic()
        return None
