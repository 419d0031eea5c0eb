"""Access: hosts, origins, tokens, sizes, times and number of all requests, and their headers."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import anyio
from fastapi import HTTPException
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse

from fpmatch.printable import printable
from fpmatch.server.errors import BUSY, RETRY
from fpmatch.server.settings import LOCAL, STATIC, digest_of

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from fpmatch.server.settings import Client, Settings

CLIENT: Final = "fpmatch.client"  # key of the client in the scope of a request
FORM_BYTES: Final = 64 * 1024  # of a request, besides its files
HEADER_BYTES: Final = 16 * 1024
MOST_FILES: Final = 2
SAFE: Final = ("GET", "HEAD")
PUBLIC: Final = {"/", "/health", "/ready", "/openapi.json"} | {
    f"/{file.name}" for file in STATIC.iterdir()
}
_HOST: Final = re.compile(r"(\[[^\]]*\]|[^\[\]@:]*)(:\d+)?")
_ADDRESS: Final = re.compile(r"[\d.]+|\[[\da-f:.]+\]")  # no name of another site looks like one
_PIECE_BYTES: Final = 64 * 1024  # of an answer, handed to the connection at a time
_DRAIN_S: Final = 2.0
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS: Final = {
    "content-security-policy": _POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
    "x-frame-options": "DENY",
}


class Access:
    """Refuse bad requests, and add security headers to every response.

    Refused are: a host that is not a name of this server (DNS rebinding), a POST from the page of
    another site, a missing token, a body that is too large or too slow, and requests beyond the
    number, or the bytes, that may be inside. A request is inside from its last byte to the last of
    its response. A response that is read too slowly is dropped.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app, self.settings = app, settings
        self.most_bytes = int(MOST_FILES * settings.limits.file_megabytes * 1e6) + FORM_BYTES
        self.inside = self.bytes_inside = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse one request, or pass it on."""
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self._app(scope, receive, send)
            else:  # no web sockets here
                await send({"type": "websocket.close"})
            return
        exchange = _Exchange(self, scope, receive, send)
        try:
            self._check(scope, exchange)
            if not is_public(scope) and not exchange.announced:
                exchange.enter()
            await self._app(scope, exchange.receive, exchange.send)
        except HTTPException as refused:  # those of the application are answered there
            await _drain(scope, receive)
            content = {"error": printable(refused.detail)}
            response = JSONResponse(content, refused.status_code, refused.headers)
            await response(scope, receive, exchange.send)
        finally:
            exchange.leave()

    def _check(self, scope: Scope, exchange: _Exchange) -> None:
        headers = Headers(scope=scope)
        if sum(len(name) + len(value) for name, value in headers.raw) > HEADER_BYTES:
            raise HTTPException(400, f"the header has more than {HEADER_BYTES // 1024} kB")
        host = headers.get("host", "")
        matched = _HOST.fullmatch(host.lower())
        name = matched[1] if matched else host
        clients = self.settings.clients
        if not (name in self.settings.hosts or (clients and _ADDRESS.fullmatch(name))):
            raise HTTPException(421, f"this server is not called {name[:80] or 'nothing'}")
        if scope["method"] not in SAFE:
            _check_origin(headers, host)
        length = headers.get("content-length", "0")
        exchange.check_size(int(length) if length.isdecimal() else self.most_bytes + 1)
        client: Client | None = LOCAL
        if clients:  # the digest of a token gives away nothing by its timing
            token = headers.get("authorization", "").removeprefix("Bearer ").strip()
            client = clients.get(digest_of(token))
        if client is not None:
            scope[CLIENT] = client
        elif not is_public(scope):
            raise HTTPException(
                401,
                "the token is missing or wrong: enter it on the page, or send the header "
                "Authorization: Bearer TOKEN",
                {"www-authenticate": "Bearer"},
            )


class _Exchange:
    """One request and its response: both have their time, and the response gets headers."""

    def __init__(self, access: Access, scope: Scope, receive: Receive, send: Send) -> None:
        self._access, self._receive, self._send = access, receive, send
        self._limits = access.settings.limits
        self._cache = "no-cache" if is_public(scope) else "no-store"
        headers = Headers(scope=scope)
        self.announced = headers.get("content-length", "0") != "0" or "transfer-encoding" in headers
        self._may_be_left = self.announced and scope.get("http_version", "1.1")[0] == "1"
        self._start = anyio.current_time()
        self._size = self._sent = 0
        self._inside = self._dropped = False

    def enter(self) -> None:
        """Count the request as inside; HTTPException if there are too many, or too many bytes."""
        access, most = self._access, 1e6 * self._limits.megabytes_at_once
        if access.inside >= self._limits.requests or (
            access.inside and access.bytes_inside + self._size > most
        ):
            raise HTTPException(503, BUSY, RETRY)
        access.inside += 1
        access.bytes_inside += self._size
        self._inside = True

    def leave(self) -> None:
        """Count the request no longer, if it was counted."""
        if self._inside:
            self._access.inside -= 1
            self._access.bytes_inside -= self._size

    def check_size(self, size: int) -> None:
        """Raise HTTPException if a body is too large."""
        if size > self._access.most_bytes:
            most = self._limits.file_megabytes
            raise HTTPException(413, f"a file may have {most:g} MB, and this is more")

    def _late(self, size: int) -> float:
        """Return the time by which so many bytes must have gone their way."""
        rate = 1000 * self._limits.kilobytes_per_second
        return self._start + self._limits.slow_seconds + size / rate

    async def receive(self) -> Message:
        """Return the next part of the body, or that the client has closed the connection.

        Raises HTTPException if the body is too slow or too large, or the server has no room.
        """
        if self._inside:
            return await self._receive()
        with anyio.move_on_at(self._late(self._size)) as waiting:
            message = await self._receive()
        if waiting.cancelled_caught:
            raise HTTPException(408, "the request took too long to arrive")
        self._size += len(message.get("body", b""))
        self.check_size(self._size)
        if message["type"] == "http.request" and not message.get("more_body", False):
            self.enter()
        return message

    async def send(self, message: Message) -> None:
        """Send one message of the response, in pieces; nothing more once it is too late."""
        if message["type"] == "http.response.start":
            self._start = anyio.current_time()
            headers = MutableHeaders(raw=list(message.get("headers", ())))
            headers.update({**_HEADERS, "cache-control": self._cache})
            if self._may_be_left and not self._inside:  # the rest of the body is not read
                headers["connection"] = "close"
            await self._send({**message, "headers": headers.raw})
            return
        body = message.get("body", b"")
        for begin in range(0, max(len(body), 1), _PIECE_BYTES):
            piece = body[begin : begin + _PIECE_BYTES]
            more = message.get("more_body", False) or begin + _PIECE_BYTES < len(body)
            with anyio.move_on_at(self._late(self._sent)) as sending:
                if not self._dropped:
                    await self._send({**message, "body": piece, "more_body": more})
            self._dropped |= sending.cancelled_caught
            self._sent += len(piece)


def is_public(scope: Scope) -> bool:
    """Return whether a request needs no token."""
    return scope["method"] in SAFE and scope["path"] in PUBLIC


def _check_origin(headers: Headers, host: str) -> None:
    """Refuse requests from the pages of other sites."""
    site, origin = headers.get("sec-fetch-site", "same-origin"), headers.get("origin")
    foreign = origin is not None and origin.lower().partition("://")[2] != host.lower()
    if foreign or site not in {"same-origin", "none"}:
        raise HTTPException(403, "only the page of this server may request this")


async def _drain(scope: Scope, receive: Receive) -> None:
    """Discard the rest of a request: browsers read no response before they have sent it all."""
    with anyio.move_on_after(_DRAIN_S):
        while scope["method"] not in SAFE and (await receive()).get("more_body", False):
            pass
