"""Connections: how many clients may have, and how long each may keep the server waiting.

uvicorn bounds neither: a connection without a whole header, or whose answer is not read, stays for
ever. `fpmatch.server.guard` bounds the time of bodies.
"""

from __future__ import annotations

import json
import logging
import socket
import time
from collections import defaultdict
from typing import TYPE_CHECKING, Any, Final

import h11
from prometheus_client import Counter as Measurement
from prometheus_client import Gauge
from uvicorn.protocols.http.h11_impl import H11Protocol

from fpmatch.server.exchange import RETRY_AFTER_S

if TYPE_CHECKING:
    import asyncio

    from prometheus_client import CollectorRegistry

    from fpmatch.server.settings import Limits

# Where a proxy on this computer connects from, which stands for many clients.
_PROXIES: Final = ("127.0.0.1", "::1")
_SYSTEM_BYTES: Final = 128 * 1024  # of an answer in the system's buffers
_UNREAD_S: Final = 1.0  # that an answer may stay unread however many bytes are
_log: Final = logging.getLogger(__name__)


class Connections:
    """All connections of a server, of which there are `most` at once, or fewer by its limits.

    The registry gets the numbers of those that are open, and that were closed, by the reason.
    """

    def __init__(self, limits: Limits, most: int, registry: CollectorRegistry) -> None:
        self._limits, self._most = limits, most
        self._open: dict[str, set[Connection]] = defaultdict(set)  # by the client's address
        self._number = 0
        self._closed = Measurement(
            "fpmatch_connections_closed",
            "Connections closed by the server because of a limit",
            ["reason"],
            registry=registry,
        )
        gauge = Gauge("fpmatch_connections", "Connections of clients", registry=registry)
        gauge.set_function(lambda: self._number)

    def enter(self, one: Connection) -> None:
        """Add a connection; at a limit, close the one that has kept the server waiting longest."""
        own = self._open[one.address]
        own.add(one)
        self._number += 1
        if len(own) > self._limits.connections_per_client and one.address not in _PROXIES:
            self._make_room(one, list(own))
        elif self._number > self._most:
            self._make_room(one, [other for some in self._open.values() for other in some])

    def leave(self, one: Connection) -> None:
        """Remove a connection that ends."""
        own = self._open.get(one.address, set())
        if one in own:
            own.remove(one)
            self._number -= 1
        if not own:
            self._open.pop(one.address, None)

    def close_late(self) -> None:
        """Close the connections that are too late."""
        now = time.monotonic()
        for one in [one for some in self._open.values() for one in some]:
            if one.unread_since(now) is not None:
                if self._reads_too_slowly(one, now):
                    self._close(one, "answer not read")
            elif one.awaits_header and now - one.since > self._limits.header_seconds:
                self._close(one, "header too late", 408)
        self.bound_unread()

    def bound_unread(self) -> None:
        """Close the connections with the oldest unread answers while these are too many bytes."""
        now = time.monotonic()
        unread = [one for some in self._open.values() for one in some if one.unread]
        too_many = sum(one.unread for one in unread) - 1e6 * self._limits.unread_megabytes
        for one in sorted(unread, key=lambda one: one.unread_since(now) or now):
            since = one.unread_since(now)
            if too_many <= 0 or since is None or now - since < _UNREAD_S:
                return
            too_many -= one.unread
            self._close(one, "too much not read")

    def _reads_too_slowly(self, one: Connection, now: float) -> bool:
        """Return whether a client has read too little since its answer was looked at last."""
        seconds = now - one.measured
        if seconds < self._limits.stalled_seconds:
            return False
        read = one.unread_then - one.unread
        one.measured, one.unread_then = now, one.unread
        return read < 1000 * self._limits.kilobytes_per_second * seconds

    def _make_room(self, new: Connection, others: list[Connection]) -> None:
        waiting = [one for one in others if one is not new and one.is_awaited]
        if waiting:
            self._close(min(waiting, key=lambda one: one.since), "too many, the slowest", 408)
        else:
            self._close(new, "too many, the latest", 503)

    def note(self, reason: str) -> None:
        """Count and log that a connection is closed."""
        self._closed.labels(reason).inc()
        _log.warning("a connection was closed: %s", reason)

    def _close(self, one: Connection, reason: str, status: int = 0) -> None:
        self.note(reason)
        self.leave(one)
        one.end(status)


_ANSWERS: Final = {
    408: ("Request Timeout", "the request took too long to arrive"),
    503: ("Service Unavailable", "too many connections at once: try again shortly"),
}


class Connection(H11Protocol):
    """One connection, which states what it waits for.

    `since` is when it began to wait for a header or a body, as `time.monotonic`; `measured` is when
    `unread` was looked at, and `unread_then` what it was.
    """

    def __init__(self, connections: Connections, **parts: Any) -> None:
        super().__init__(**parts)
        self._connections = connections
        self.address = ""
        self.since = time.monotonic()
        self._unread_since: float | None = None
        self.measured, self.unread_then = 0.0, 0
        self._received = False

    @property
    def unread(self) -> int:
        """Bytes of answers that the client has not read, besides those in the system's buffers."""
        return self.transport.get_write_buffer_size()

    @property
    def awaits_header(self) -> bool:
        """Whether a request is to come, or is incomplete."""
        return self.cycle is None or self.cycle.response_complete

    @property
    def is_awaited(self) -> bool:
        """Whether the server waits for the client: for a header, a body, or an answer to be read.

        A client whose request waits unread for its turn is not awaited.
        """
        receives = self.awaits_header or self.cycle.more_body
        return bool(self.unread) or (receives and not self.flow.read_paused)

    def unread_since(self, now: float) -> float | None:
        """Return since when there is something unread, None if there is nothing."""
        if not self.unread:
            self._unread_since = None
        elif self._unread_since is None:
            self._unread_since = self.measured = now
            self.unread_then = self.unread
        return self._unread_since

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Count the connection."""
        super().connection_made(transport)
        self.address = self.client[0] if self.client else ""
        # what the system keeps of an answer is out of sight, and makes room in large steps
        own = transport.get_extra_info("socket")
        own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SYSTEM_BYTES)
        self._connections.enter(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._connections.leave(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Pass bytes on, and note when a header is whole."""
        if self.transport.is_closing():
            return
        awaited, self._received = self.awaits_header, True
        super().data_received(data)
        if awaited and not self.awaits_header:
            self.since = time.monotonic()

    def pause_writing(self) -> None:
        """Keep an answer that is not read, and close others where that is too many bytes."""
        super().pause_writing()
        self._connections.bound_unread()

    def on_response_complete(self) -> None:
        """Wait for the next header; close the connection if it has come before the response.

        A client that sends requests without waiting would keep the server from others.
        """
        self.since, self._received = time.monotonic(), False
        if self.conn.their_state is h11.DONE and self.conn.trailing_data[0].strip():
            self._connections.note("pipelined")
            self.transport.close()
        super().on_response_complete()

    def end(self, status: int) -> None:
        """Close the connection, with an answer if a part of a request has come; at once for 0."""
        if status and self.awaits_header and not self.unread:
            if self._received or status in _REFUSALS:
                self.transport.write(_answer(status))
            self.transport.close()
        else:
            self.transport.abort()


_REFUSALS: Final = (503,)


def _answer(status: int) -> bytes:
    """Return a whole response."""
    title, sentence = _ANSWERS[status]
    content = json.dumps({"error": sentence})
    head = [
        f"HTTP/1.1 {status} {title}",
        "content-type: application/json",
        f"content-length: {len(content)}",
        f"retry-after: {RETRY_AFTER_S}",
        "connection: close",
    ]
    return "\r\n".join([*head, "", content]).encode()
