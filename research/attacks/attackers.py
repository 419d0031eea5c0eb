"""The attackers: connections that follow the script of an attack, in a process of their own."""

from __future__ import annotations

import asyncio
import re
import socket
import struct
import time
from collections import Counter
from contextlib import suppress
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterator
    from multiprocessing.connection import Connection

    from research.attacks.kinds import Attack

_ACCEPTED_S: Final = 5.0  # that a connection may take to be accepted
_REST_S: Final = 2.0  # to read an answer at the end
_BACK_S: Final = 1.0  # until an attacker comes back
_RESET: Final = struct.pack("ii", 1, 0)  # SO_LINGER: a close resets the connection
_CHUNK: Final = 65_536


class Attackers:
    """The connections of one attack; they run from `start` to `stop`."""

    def __init__(self, attack: Attack, place: tuple[str, int], source: str) -> None:
        self._pipe, other = get_context("spawn").Pipe()
        self._process = get_context("spawn").Process(
            target=_run, args=(attack, place, source, other), daemon=True
        )

    def start(self) -> None:
        """Return when every connection has been made or refused once, and unread ones answered."""
        self._process.start()
        self._pipe.recv()

    def stop(self) -> Counter[str]:
        """End the attack; return what became of its connections."""
        self._pipe.send(None)
        fates: Counter[str] = self._pipe.recv()
        self._process.join()
        return fates


def _run(attack: Attack, place: tuple[str, int], source: str, pipe: Connection) -> None:
    asyncio.run(_attack(attack, place, source, pipe))


async def _attack(attack: Attack, place: tuple[str, int], source: str, pipe: Connection) -> None:
    fates: Counter[str] = Counter()
    begun = [asyncio.Event() for _ in range(attack.connections)]
    ends = asyncio.Event()
    tasks = [
        asyncio.create_task(_follow(attack, place, source, fates, first, ends)) for first in begun
    ]
    await asyncio.gather(*(first.wait() for first in begun))
    pipe.send(None)
    await asyncio.to_thread(pipe.recv)
    ends.set()
    await asyncio.gather(*tasks)
    pipe.send(fates)


async def _follow(
    attack: Attack,
    place: tuple[str, int],
    source: str,
    fates: Counter[str],
    begun: asyncio.Event,
    ends: asyncio.Event,
) -> None:
    """Follow the script on one connection after the other."""
    while not ends.is_set():
        with socket.socket() as one:
            one.setblocking(False)
            if not attack.reads:
                one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            fates[await _connect_and_send(attack, one, place, source, begun, ends)] += 1
        begun.set()
        if not attack.comes_back:
            return
        with suppress(TimeoutError):
            await asyncio.wait_for(ends.wait(), _BACK_S if not attack.leaves else 0.01)


async def _connect_and_send(
    attack: Attack,
    one: socket.socket,
    place: tuple[str, int],
    source: str,
    begun: asyncio.Event,
    ends: asyncio.Event,
) -> str:
    """Return what became of a connection."""
    loop = asyncio.get_running_loop()
    try:
        one.bind((source, 0))
        await asyncio.wait_for(loop.sock_connect(one, place), _ACCEPTED_S)
    except (OSError, TimeoutError):
        return "not accepted"
    start = time.monotonic()
    if attack.reads:
        begun.set()
    sending = asyncio.create_task(_send(one, attack.script()))
    reading = asyncio.create_task(_read(one) if attack.reads else _wait_for_answer(one, begun))
    ending = asyncio.create_task(ends.wait())
    waited = {reading, ending, *([sending] if attack.leaves else [])}
    await asyncio.wait(waited, return_when=asyncio.FIRST_COMPLETED)
    seconds = time.monotonic() - start
    if attack.leaves and sending.done() and not reading.done():
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
    if not attack.reads:
        sending.cancel()
    fate = await _fate(attack, one, reading, sending)
    for task in (sending, reading, ending):
        task.cancel()
    await asyncio.gather(sending, reading, ending, return_exceptions=True)
    return fate if "closed" not in fate else f"{fate} within {_rounded(seconds)} s"


async def _fate(
    attack: Attack, one: socket.socket, reading: asyncio.Task[str], sending: asyncio.Task[Any]
) -> str:
    if not attack.reads:
        return await _rest(one)
    if reading.done():
        return reading.result()
    return "left" if attack.leaves and sending.done() else "held to the end"


async def _send(one: socket.socket, script: Iterator[tuple[bytes, float]]) -> None:
    loop = asyncio.get_running_loop()
    with suppress(OSError):
        for data, pause in script:
            await loop.sock_sendall(one, data)
            await asyncio.sleep(pause)


async def _read(one: socket.socket) -> str:
    """Read until the server closes; return how it did."""
    loop, status = asyncio.get_running_loop(), ""
    try:
        while data := await loop.sock_recv(one, _CHUNK):
            status = status or data[9:12].decode("latin-1")
    except OSError:
        pass
    return f"closed with {status}" if status else "closed"


async def _wait_for_answer(one: socket.socket, begun: asyncio.Event) -> str:
    """Wait for the first byte of the answer, which is not read, then for ever."""
    loop = asyncio.get_running_loop()
    readable = asyncio.Event()
    loop.add_reader(one.fileno(), readable.set)
    try:
        await readable.wait()
    finally:
        loop.remove_reader(one.fileno())
    begun.set()
    await asyncio.Event().wait()
    return ""


async def _rest(one: socket.socket) -> str:
    """Read what the server still sends; return whether it is the whole answer."""
    answer = bytearray()
    one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    with suppress(OSError, TimeoutError):
        async with asyncio.timeout(_REST_S):
            while data := await asyncio.get_running_loop().sock_recv(one, _CHUNK):
                answer += data
    head, _, body = answer.partition(b"\r\n\r\n")
    if not head:
        return "cut off"
    length = re.search(rb"(?i)content-length: *(\d+)", head)
    if length and len(body) < int(length[1]):
        return "cut off"
    return f"answered {head[9:12].decode('latin-1')}"


def _rounded(seconds: float) -> int:
    """Return a number of seconds for a table: 1, 2, 5, 10, 20 and so on."""
    steps = (1, 2, 5, 10, 20, 50)
    return next((step for step in steps if seconds <= step * 1.1), 100)
