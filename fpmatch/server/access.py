"""Access: hosts, origins, tokens, sizes, times and number of all requests, and their headers."""

from __future__ import annotations

import ipaddress
from typing import TYPE_CHECKING, Final

import anyio
from fastapi import HTTPException

from fpmatch.server.errors import BUSY, RETRY, send_error
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
_PIECE_BYTES: Final = 64 * 1024  # of an answer, handed to the connection at a time
_DRAIN_S: Final = 2.0
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS: Final = (
    (b"content-security-policy", _POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"permissions-policy", b"camera=(), microphone=(), geolocation=()"),
    (b"x-frame-options", b"DENY"),
)


class Access:
    """Refuse bad requests, and add security headers to every response.

    Refused are: a host that is not a name of this server (DNS rebinding), a POST from the page of
    another site, a missing token, a body that is too large or too slow, and requests beyond the
    number, or the bytes, that may be inside. A request is inside from its last byte to the last of
    its response. A response that is read too slowly is dropped.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app, self._settings = app, settings
        self._most_bytes = int(MOST_FILES * settings.limits.file_megabytes * 1e6) + FORM_BYTES
        self.inside = self._bytes_inside = 0

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
            self._check(scope)
            if not is_public(scope) and not exchange.announced:
                exchange.enter()
            await self._app(scope, exchange.receive, exchange.send)
        except HTTPException as refused:  # those of the application are answered there
            await _drain(scope, receive)
            await send_error(exchange.send, refused)
        finally:
            exchange.leave()

    def enter(self, size: int) -> None:
        """Count a request whose body has so many bytes; HTTPException if there are too many."""
        limits = self._settings.limits
        most = 1e6 * limits.megabytes_at_once
        if self.inside >= limits.requests or (self.inside and self._bytes_inside + size > most):
            raise HTTPException(503, BUSY, RETRY)
        self.inside += 1
        self._bytes_inside += size

    def leave(self, size: int) -> None:
        """Count a request no longer."""
        self.inside -= 1
        self._bytes_inside -= size

    def check_size(self, size: int) -> None:
        """Raise HTTPException if a body is too large."""
        if size > self._most_bytes:
            most = self._settings.limits.file_megabytes
            raise HTTPException(413, f"a file may have {most:g} MB, and this is more")

    def slowest(self, size: int) -> float:
        """Return the seconds that so many bytes may take on their way."""
        limits = self._settings.limits
        return limits.slow_seconds + size / (1000 * limits.kilobytes_per_second)

    def _check(self, scope: Scope) -> None:
        headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
        if sum(len(name) + len(value) for name, value in scope["headers"]) > HEADER_BYTES:
            raise HTTPException(400, f"the header has more than {HEADER_BYTES // 1024} kB")
        host = headers.get(b"host", "")
        name = _without_port(host).lower()
        if not self._is_ours(name):
            raise HTTPException(421, f"this server is not called {name[:80] or 'nothing'}")
        if scope["method"] not in SAFE:
            _check_origin(headers, host)
        length = headers.get(b"content-length", "0")
        self.check_size(int(length) if length.isdecimal() else self._most_bytes + 1)
        client = self._client(headers.get(b"authorization", ""))
        if client is not None:
            scope[CLIENT] = client
        elif not is_public(scope):
            raise HTTPException(
                401,
                "the token is missing or wrong: enter it on the page, or send the header "
                "Authorization: Bearer TOKEN",
                {"www-authenticate": "Bearer"},
            )

    def _client(self, authorization: str) -> Client | None:
        """Return who sends a request; the digest of a token gives away nothing by its timing."""
        clients = self._settings.clients
        if not clients:
            return LOCAL
        return clients.get(digest_of(authorization.removeprefix("Bearer ").strip()))

    def _is_ours(self, name: str) -> bool:
        if name in self._settings.hosts:
            return True
        return bool(self._settings.clients) and _is_address(name)


class _Exchange:
    """One request and its response: both have their time, and the response gets headers."""

    def __init__(self, access: Access, scope: Scope, receive: Receive, send: Send) -> None:
        self._access, self._receive, self._send = access, receive, send
        self._cache = b"no-cache" if is_public(scope) else b"no-store"
        headers = dict(scope["headers"])
        self.announced = headers.get(b"content-length", b"0") != b"0" or (
            b"transfer-encoding" in headers
        )
        self._may_be_left = self.announced and scope.get("http_version", "1.1")[0] == "1"
        self._start = anyio.current_time()
        self._size = self._sent = 0
        self._inside = self._dropped = False

    def enter(self) -> None:
        """Count the request as inside."""
        self._access.enter(self._size)
        self._inside = True

    def leave(self) -> None:
        """Count the request no longer, if it was counted."""
        if self._inside:
            self._access.leave(self._size)

    async def receive(self) -> Message:
        """Return the next part of the body, or that the client has closed the connection.

        Raises HTTPException if the body is too slow or too large, or the server has no room.
        """
        if self._inside:
            return await self._receive()
        late = self._start + self._access.slowest(self._size)
        with anyio.move_on_at(late) as waiting:
            message = await self._receive()
        if waiting.cancelled_caught:
            raise HTTPException(408, "the request took too long to arrive")
        self._size += len(message.get("body", b""))
        self._access.check_size(self._size)
        if message["type"] == "http.request" and not message.get("more_body", False):
            self.enter()
        return message

    async def send(self, message: Message) -> None:
        """Send one message of the response, in pieces; nothing more once it is too late."""
        if message["type"] == "http.response.start":
            self._start = anyio.current_time()
            added = [*_HEADERS, (b"cache-control", self._cache)]
            if self._may_be_left and not self._inside:  # the rest of the body is not read
                added.append((b"connection", b"close"))
            await self._send({**message, "headers": [*message.get("headers", ()), *added]})
            return
        body = message.get("body", b"")
        for begin in range(0, max(len(body), 1), _PIECE_BYTES):
            piece = body[begin : begin + _PIECE_BYTES]
            more = message.get("more_body", False) or begin + _PIECE_BYTES < len(body)
            with anyio.move_on_at(self._start + self._access.slowest(self._sent)) as sending:
                if not self._dropped:
                    await self._send({**message, "body": piece, "more_body": more})
            self._dropped |= sending.cancelled_caught
            self._sent += len(piece)


def is_public(scope: Scope) -> bool:
    """Return whether a request needs no token."""
    return scope["method"] in SAFE and scope["path"] in PUBLIC


def _check_origin(headers: dict[bytes, str], host: str) -> None:
    """Refuse requests from the pages of other sites."""
    site = headers.get(b"sec-fetch-site", "same-origin")
    origin = headers.get(b"origin")
    foreign = origin is not None and origin.lower().partition("://")[2] != host.lower()
    if foreign or site not in {"same-origin", "none"}:
        raise HTTPException(403, "only the page of this server may request this")


def _without_port(host: str) -> str:
    """Return the name of a Host header; all of it where what follows the name is no port.

    Examples
    --------
    >>> _without_port("localhost:8000"), _without_port("[::1]:8000"), _without_port("host")
    ('localhost', '[::1]', 'host')
    """
    name, colon, port = host.rpartition(":")
    return name if colon and port.isdecimal() else host


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True


async def _drain(scope: Scope, receive: Receive) -> None:
    """Discard the rest of a request: browsers read no response before they have sent it all."""
    with anyio.move_on_after(_DRAIN_S):
        while scope["method"] not in SAFE and (await receive()).get("more_body", False):
            pass
