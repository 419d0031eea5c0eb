"""The attacks: what each of their connections sends, and when."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from typing import Final

from research.attacks.requests import (
    PROBE,
    REFERENCE,
    multipart,
    noisy_print,
    post_head,
    whole_post,
)

_HEAD: Final = b"GET /health HTTP/1.1\r\nhost: localhost\r\n"
_HEALTH: Final = _HEAD + b"\r\n"
_LARGE: Final = 60_000_000  # bytes that a slow upload announces

Script = Iterator[tuple[bytes, float]]  # what is sent, and seconds until the next is


@dataclass(frozen=True)
class Attack:
    """The connections of an attack: their number, what they send, and whether they read."""

    name: str
    connections: int
    script: Callable[[], Script]
    reads: bool = True
    comes_back: bool = True  # with a new connection for each that ends
    leaves: bool = False  # resets the connection at the end of the script
    main: bool = False  # one of the three for which targets are set
    hangs: bool = False  # while the gallery does not answer


def _nothing() -> Script:
    yield b"", 1e9


def _half_header() -> Script:
    yield _HEAD + b"x-a: ", 1e9


def _slow_header() -> Script:
    yield _HEAD, 1.0
    for number in count():
        yield f"x-{number}: a\r\n".encode(), 1.0


def _many_headers() -> Script:
    yield _HEAD, 0.0
    for number in count():
        yield b"".join(b"x-%d-%d: a\r\n" % (number, k) for k in range(200)), 0.05


def _huge_header() -> Script:
    yield _HEAD + b"x-a: ", 0.0
    while True:
        yield b"a" * 65_536, 0.05


def _slow_upload() -> Script:
    body = multipart(probe=PROBE, reference=REFERENCE)
    yield post_head("/verify", f"content-length: {len(body)}"), 0.0
    for byte in body:
        yield bytes([byte]), 1.0


def _trickled_upload() -> Script:
    yield post_head("/verify", f"content-length: {_LARGE}"), 0.0
    yield multipart(probe=PROBE)[:200], 0.0
    while True:
        yield bytes(4096), 0.2


def _slow_chunks() -> Script:
    yield post_head("/verify", "transfer-encoding: chunked"), 0.0
    for byte in multipart(probe=PROBE, reference=REFERENCE):
        yield b"1\r\n%c\r\n" % byte, 1.0


def _pipelined() -> Script:
    while True:
        yield 100 * _HEALTH, 0.5


def _unread() -> Script:
    yield whole_post("/compare", probe=noisy_print(), reference=REFERENCE), 1e9


def _coming_and_going() -> Script:
    yield _HEALTH, 0.1


def _aborted() -> Script:
    yield whole_post("/verify", probe=PROBE, reference=REFERENCE)[:40_000], 0.1


def _idle() -> Script:
    yield _HEALTH, 1e9


def _ready() -> Script:
    yield b"GET /ready HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n", 1e9


def _identify() -> Script:
    yield whole_post("/identify", "connection: close", probe=PROBE), 1e9


def _enrol() -> Script:
    yield whole_post("/enrol", "connection: close", image=REFERENCE), 1e9


ATTACKS: Final = (
    Attack("half a header", 300, _half_header, main=True),
    Attack("slow uploads", 40, _slow_upload, main=True),
    Attack("answers unread", 36, _unread, reads=False, comes_back=False, main=True),
    Attack("no byte", 300, _nothing),
    Attack("a header line a second", 300, _slow_header),
    Attack("endless header lines", 40, _many_headers),
    Attack("one endless header", 40, _huge_header),
    Attack("20 kB/s uploads", 40, _trickled_upload),
    Attack("slow chunks", 40, _slow_chunks),
    Attack("pipelined, read", 4, _pipelined),
    Attack("pipelined, unread", 40, _pipelined, reads=False),
    Attack("come and go", 20, _coming_and_going, leaves=True),
    Attack("aborted uploads", 20, _aborted, leaves=True),
    Attack("idle keep-alive", 300, _idle),
    Attack("gallery hangs, six ask /ready", 6, _ready, hangs=True),
    Attack("gallery hangs, 50 ask /ready", 50, _ready, hangs=True),
    Attack("gallery hangs, 50 identify", 50, _identify, hangs=True),
    Attack("gallery hangs, 50 enrol", 50, _enrol, hangs=True),
)
