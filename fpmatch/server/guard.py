"""Guard: checks of hosts, origins, token, size and number of all requests."""

from __future__ import annotations

import ipaddress
from typing import TYPE_CHECKING, Final

import anyio

from fpmatch.printable import printable
from fpmatch.server.errors import send_error
from fpmatch.server.gate import BusyError, Gate
from fpmatch.server.settings import LOCAL, digest_of

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from fpmatch.server.settings import Client, Settings

CLIENT: Final = "fpmatch.client"  # key of the client in the scope of a request
RETRY_AFTER_S: Final = 5
FORM_BYTES: Final = 64 * 1024  # of a request, besides its files
HEADER_BYTES: Final = 16 * 1024  # h11 bounds only what comes in several pieces
MOST_FILES: Final = 2
SMALL_BYTES: Final = 1_000_000  # smaller requests are read at once, without a turn
_CLOSE: Final = (b"connection", b"close")
_DRAINED: Final = 4  # times the largest request is read and discarded before a refusal
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
_SAFE: Final = ("GET", "HEAD")
# Files that need no token: the web interface and the description of the API.
_PUBLIC_SUFFIXES: Final = (".html", ".css", ".js", ".svg", ".json")
_PUBLIC: Final = ("/", "/health", "/ready")


class _RefusedError(Exception):
    """A request is refused, with a status and one sentence."""

    def __init__(self, status: int, sentence: str, *headers: tuple[bytes, bytes]) -> None:
        super().__init__(sentence)
        self.status, self.sentence, self.headers = status, printable(sentence), headers


class _Exchange:
    """One request and its response, which gets security headers or is replaced by a refusal.

    It holds a place among the requests that are worked on, from its last byte to the first of its
    response: neither a slow upload nor an answer that is not read keeps a place from others.
    """

    def __init__(self, scope: Scope, send: Send, places: Gate, patience: float) -> None:
        self._cache = b"no-cache" if _is_public(scope) else b"no-store"
        self._send = send
        self._begun = False
        self._places, self._inside = places, False
        self._patience = patience  # seconds that it may still wait for its turn
        self.refused: _RefusedError | None = None

    async def wait_for(self, gate: Gate, amount: float) -> None:
        """Take an amount of what a gate bounds; refused after the time that a request may wait."""
        start = anyio.current_time()
        try:
            await gate.enter(amount, self._patience)
        except BusyError:
            retry = (b"retry-after", str(RETRY_AFTER_S).encode())
            sentence = "too many requests at once: try again shortly"
            raise self.refuse(_RefusedError(503, sentence, retry)) from None
        self._patience = max(0.0, self._patience - (anyio.current_time() - start))

    async def enter(self) -> None:
        """Wait for a place."""
        await self.wait_for(self._places, 1)
        self._inside = True

    def leave(self) -> None:
        """Give the place back, if there is one."""
        if self._inside:
            self._inside = False
            self._places.leave(1)

    def refuse(self, refused: _RefusedError) -> _RefusedError:
        """Make this the response, whatever the application makes of the exception."""
        if not self._begun:
            self.refused = refused
        return refused

    async def send(self, message: Message) -> None:
        """Send one message of the response."""
        if self.refused is not None:
            return
        if message["type"] == "http.response.start":
            self._begun = True
            self.leave()
            added = (*_HEADERS, (b"cache-control", self._cache))
            message = {**message, "headers": [*message.get("headers", ()), *added]}
        await self._send(message)


class Guard:
    """Refuse bad requests, and add security headers to every response.

    Refused are: a host that is not a name of this server (DNS rebinding), a POST from the page of
    another site, a missing token, a body that is too large or too slow, and requests that waited
    too long for their turn. Large requests wait unread until there is room for all their bytes, and
    every request waits for a place when it has arrived.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app, self._settings = app, settings
        limits = settings.limits
        self._places = Gate(settings.workers + limits.waiting, limits.queue)
        self._bytes = Gate(limits.megabytes_at_once * 1e6, limits.queue)
        self._most_bytes = int(MOST_FILES * limits.file_megabytes * 1e6) + FORM_BYTES

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse one request, or pass it on."""
        if scope["type"] != "http":
            if scope["type"] == "lifespan":
                await self._app(scope, receive, send)
            return  # no web sockets here
        exchange = _Exchange(scope, send, self._places, self._settings.limits.wait_seconds)
        try:
            self._check(scope)
            if _is_public(scope):
                await self._app(scope, receive, exchange.send)
                return
            await self._pass_on(scope, receive, exchange)
            if exchange.refused is not None:
                raise exchange.refused
        except _RefusedError as refused:
            await _drain(scope, receive, _DRAINED * self._most_bytes)
            exchange.refused = None
            await send_error(exchange.send, refused.status, refused.sentence, *refused.headers)

    async def _pass_on(self, scope: Scope, receive: Receive, exchange: _Exchange) -> None:
        """Let a request wait for its turn, then pass it on."""
        announced = self._announced_bytes(scope)
        large = announced if announced > SMALL_BYTES else 0
        if large:
            await exchange.wait_for(self._bytes, large)
        try:
            if not announced:
                await exchange.enter()
            await self._app(scope, self._bounded(receive, exchange, announced), exchange.send)
        finally:
            exchange.leave()
            if large:
                self._bytes.leave(large)

    @property
    def inside(self) -> int:
        """Requests that are worked on, or wait for a worker."""
        return int(self._places.taken)

    @property
    def waiting(self) -> int:
        """Requests that wait for their turn."""
        return self._places.waiting + self._bytes.waiting

    def _check(self, scope: Scope) -> None:
        headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
        if sum(len(name) + len(value) for name, value in scope["headers"]) > HEADER_BYTES:
            raise _RefusedError(400, f"the header has more than {HEADER_BYTES // 1024} kB")
        host = headers.get(b"host", "")
        name = _without_port(host).lower()
        if not self._is_ours(name):
            raise _RefusedError(421, f"this server is not called {name[:80] or 'nothing'}")
        if scope["method"] not in _SAFE:
            _check_origin(headers, host)
        length = headers.get(b"content-length", "0")
        if not length.isdecimal() or int(length) > self._most_bytes:
            raise self._too_large()
        client = self._client(headers.get(b"authorization", ""))
        if client is not None:
            scope[CLIENT] = client
        elif not _is_public(scope):
            raise _RefusedError(
                401,
                "the token is missing or wrong: open the address that the server printed, or send "
                "the header Authorization: Bearer TOKEN",
                (b"www-authenticate", b"Bearer"),
            )

    def _client(self, authorization: str) -> Client | None:
        """Return who sends a request; the digest of a token gives away nothing by its timing."""
        clients = self._settings.clients
        if not clients:
            return LOCAL
        return clients.get(digest_of(authorization.removeprefix("Bearer ").strip()))

    def _announced_bytes(self, scope: Scope) -> int:
        """Return the announced bytes of a request; where it announces none, the largest number."""
        headers = dict(scope["headers"])
        if b"transfer-encoding" in headers:
            return self._most_bytes
        return int(headers.get(b"content-length", b"0"))

    def _is_ours(self, name: str) -> bool:
        if name in self._settings.hosts:
            return True
        return bool(self._settings.clients) and _is_address(name)

    def _bounded(self, receive: Receive, exchange: _Exchange, announced: int) -> Receive:
        """Return a `receive` that refuses bodies that are too large or too slow.

        It returns the end of the body when the request has a place.
        """
        limits = self._settings.limits
        rate = 1000 * limits.kilobytes_per_second
        size, whole = 0, not announced
        start = last = anyio.current_time()

        async def receiving() -> Message:
            nonlocal size, whole, last
            if whole:
                return await receive()  # that the client has closed the connection
            slowest = min(start + size / rate, last) + limits.stalled_seconds
            with anyio.move_on_at(min(slowest, start + limits.upload_seconds)) as scope:
                message = await receive()
            if scope.cancelled_caught:
                sentence = "the request took too long to arrive"
                raise exchange.refuse(_RefusedError(408, sentence, _CLOSE))
            size, last = size + len(message.get("body", b"")), anyio.current_time()
            if size > self._most_bytes:
                raise exchange.refuse(self._too_large())
            whole = not message.get("more_body", False)
            if whole and message["type"] == "http.request":
                await exchange.enter()
            return message

        return receiving

    def _too_large(self) -> _RefusedError:
        most = self._settings.limits.file_megabytes
        return _RefusedError(413, f"a file may have {most:g} MB, and this is more")


def _check_origin(headers: dict[bytes, str], host: str) -> None:
    """Refuse requests from the pages of other sites."""
    site = headers.get(b"sec-fetch-site", "same-origin")
    origin = headers.get(b"origin")
    foreign = origin is not None and origin.lower().partition("://")[2] != host.lower()
    if foreign or site not in {"same-origin", "none"}:
        raise _RefusedError(403, "only the page of this server may request this")


def _is_public(scope: Scope) -> bool:
    path = scope["path"]
    return scope["method"] in _SAFE and (path in _PUBLIC or path.endswith(_PUBLIC_SUFFIXES))


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


async def _drain(scope: Scope, receive: Receive, most: int) -> None:
    """Discard the rest of a request: browsers read no response before they have sent it all."""
    if scope["method"] in _SAFE:
        return
    with anyio.move_on_after(2.0):
        while most > 0:
            message = await receive()
            most -= len(message.get("body", b""))
            if message["type"] == "http.disconnect" or not message.get("more_body", False):
                return
