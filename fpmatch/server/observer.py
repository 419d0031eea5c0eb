"""Observer: measures and logs every request."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Final

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector

from fpmatch.server.guard import CLIENT

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from fpmatch.server.guard import Guard

_SECONDS: Final = (0.01, 0.03, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0)
_log: Final = logging.getLogger("fpmatch.access")


class Observer:
    """Measure and log every request."""

    def __init__(self, guard: Guard) -> None:
        self._app: ASGIApp = guard
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
        inside = Gauge("fpmatch_requests_inside", "Requests read or worked on", registry=registry)
        inside.set_function(lambda: guard.inside)
        waiting = Gauge("fpmatch_requests_waiting", "Requests not read yet", registry=registry)
        waiting.set_function(lambda: guard.waiting)

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

        scope["fpmatch.observer"] = self
        try:
            await self._app(scope, receive, sending)
        finally:
            self._account(scope, method, status, time.perf_counter() - start)

    def _account(self, scope: Scope, method: str, status: int, seconds: float) -> None:
        route = route_of(scope)
        self._requests.labels(route, status).inc()
        self._seconds.labels(route).observe(seconds)
        client = scope.get(CLIENT)
        name = "-" if client is None else client.name
        fields = {
            "client": name,
            "address": (scope.get("client") or ("-",))[0],
            "method": method,
            "route": route,
            "status": status,
            "seconds": round(seconds, 4),
        }
        _log.info(
            "%s %s %s %s %d %.3f s",
            fields["address"],
            name,
            method,
            route,
            status,
            seconds,
            extra=fields,
        )


def route_of(scope: Scope) -> str:
    """Return the address of the API that a request is for."""
    return getattr(scope.get("route"), "path", "other")
