"""Exchange: a request that waits for what it needs, in the order of arrival, and its response."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import anyio

from fpmatch.printable import printable

if TYPE_CHECKING:
    from starlette.types import Message, Scope, Send

    from fpmatch.server.readiness import Check


class BusyError(Exception):
    """A request has waited too long, or too many wait."""


class Gate:
    """Let requests in while what they take together stays within a bound; others wait.

    A single request is let in however much it takes. Up to `queue` requests wait.
    """

    def __init__(self, most: float, queue: int) -> None:
        self._most, self._most_waiting = most, queue
        self._queue: deque[tuple[float, anyio.Event]] = deque()  # amount, and what ends the wait
        self.taken = 0.0

    @property
    def waiting(self) -> int:
        """Requests that wait."""
        return len(self._queue)

    async def enter(self, amount: float, seconds: float) -> None:
        """Take an amount as soon as there is room; BusyError after so many seconds."""
        if not self._queue and self._has_room(amount):
            self.taken += amount
            return
        if len(self._queue) >= self._most_waiting:
            raise BusyError
        place = (amount, anyio.Event())
        self._queue.append(place)
        try:
            with anyio.move_on_after(seconds):
                await place[1].wait()
        except BaseException:
            self._abandon(place)
            raise
        if not place[1].is_set():
            self._abandon(place)
            raise BusyError

    def leave(self, amount: float) -> None:
        """Give an amount back."""
        self.taken -= amount
        self._admit()

    def _abandon(self, place: tuple[float, anyio.Event]) -> None:
        """Give back what a request holds that ended while it waited."""
        if place[1].is_set():
            self.leave(place[0])
        else:
            self._queue.remove(place)
            self._admit()

    def _has_room(self, amount: float) -> bool:
        return self.taken + amount <= self._most or not self.taken

    def _admit(self) -> None:
        while self._queue and self._has_room(self._queue[0][0]):
            amount, admitted = self._queue.popleft()
            self.taken += amount
            admitted.set()


RETRY_AFTER_S: Final = 5
_RETRY: Final = (b"retry-after", str(RETRY_AFTER_S).encode())
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
SAFE: Final = ("GET", "HEAD")
# Files that need no token: the web interface and the description of the API.
_PUBLIC_SUFFIXES: Final = (".html", ".css", ".js", ".svg", ".json")
_PUBLIC: Final = ("/", "/health", "/ready")


class RefusedError(Exception):
    """A request is refused, with a status and one sentence."""

    def __init__(self, status: int, sentence: str, *headers: tuple[bytes, bytes]) -> None:
        super().__init__(sentence)
        self.status, self.sentence, self.headers = status, printable(sentence), headers


@dataclass(frozen=True, slots=True)
class Needs:
    """What requests of a kind wait for: places, room for bytes, the gallery if they need it."""

    places: Gate
    room: Gate
    gallery: Check | None = None


class Exchange:
    """One request and its response, which gets security headers or is replaced by a refusal.

    It holds a place among the requests that are worked on, from its last byte to the first of its
    response: neither a slow upload nor an answer that is not read keeps a place from others.
    """

    def __init__(self, scope: Scope, send: Send, needs: Needs, patience: float) -> None:
        self._cache = b"no-cache" if is_public(scope) else b"no-store"
        self._send = send
        self._begun = False
        self._needs, self._inside = needs, False
        self._patience = patience  # seconds that it may still wait for its turn
        self.refused: RefusedError | None = None

    async def wait_for(self, gate: Gate, amount: float) -> None:
        """Take an amount of what a gate bounds; refused after the time that a request may wait."""
        start = anyio.current_time()
        try:
            await gate.enter(amount, self._patience)
        except BusyError:
            sentence = "too many requests at once: try again shortly"
            raise self.refuse(RefusedError(503, sentence, _RETRY)) from None
        self._patience = max(0.0, self._patience - (anyio.current_time() - start))

    async def enter(self) -> None:
        """Wait for a place; refused if the gallery does not answer any more."""
        await self.wait_for(self._needs.places, 1)
        self._inside = True
        await self.check_gallery()

    async def check_gallery(self) -> None:
        """Refuse the request if it needs the gallery, which does not answer."""
        gallery = self._needs.gallery
        fault = None if gallery is None else await gallery.fault()
        if fault is not None and fault.code == "late":
            sentence = "the gallery does not answer: try again shortly"
            raise self.refuse(RefusedError(503, sentence, _RETRY))

    def leave(self) -> None:
        """Give the place back, if there is one."""
        if self._inside:
            self._inside = False
            self._needs.places.leave(1)

    def refuse(self, refused: RefusedError) -> RefusedError:
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


def is_public(scope: Scope) -> bool:
    """Return whether a request needs no token."""
    path = scope["path"]
    return scope["method"] in SAFE and (path in _PUBLIC or path.endswith(_PUBLIC_SUFFIXES))
