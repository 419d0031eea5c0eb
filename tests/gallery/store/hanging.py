"""A gallery that stops answering, and goes on later: a held file, or a proxy that holds bytes."""

from __future__ import annotations

import socket
import sqlite3
import threading
from contextlib import closing, contextmanager, suppress
from typing import TYPE_CHECKING, Final

import sqlalchemy as sa

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_CHUNK: Final = 65_536
_DEFAULT_PORT: Final = 5432


class Proxy:
    """Forward connections from a port of this computer to a server; hold all bytes while `hangs`.

    Connections are accepted all the time, as by a server whose processes are stopped.
    """

    def __init__(self, host: str, port: int) -> None:
        self._server = host, port
        self._flows = threading.Event()
        self._flows.set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    @contextmanager
    def hangs(self) -> Iterator[None]:
        """Hold what is sent in either direction until the end of the block."""
        self._flows.clear()
        try:
            yield
        finally:
            self._flows.set()

    def close(self) -> None:
        """Accept no more connections."""
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def _accept(self) -> None:
        with suppress(OSError):  # it is closed
            while True:
                near, _ = self._listener.accept()
                threading.Thread(target=self._connect, args=(near,), daemon=True).start()

    def _connect(self, near: socket.socket) -> None:
        with near, socket.create_connection(self._server) as far:
            back = threading.Thread(target=self._forward, args=(far, near), daemon=True)
            back.start()
            self._forward(near, far)
            back.join()

    def _forward(self, source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(_CHUNK):
                self._flows.wait()
                target.sendall(data)
        self._flows.wait()
        with suppress(OSError):
            target.shutdown(socket.SHUT_WR)


class HangingFile:
    """A gallery in a file, which another program may hold so that nobody can read it."""

    def __init__(self, path: Path) -> None:
        self.place = str(path)

    @contextmanager
    def hangs(self) -> Iterator[None]:
        """Hold the file until the end of the block."""
        with closing(sqlite3.connect(self.place, timeout=60.0, isolation_level=None)) as other:
            other.execute("BEGIN EXCLUSIVE")
            yield


class HangingDatabase:
    """A gallery in a PostgreSQL database, through a proxy that may hold what is sent."""

    def __init__(self, url: str) -> None:
        parsed = sa.make_url(url)
        proxy = Proxy(parsed.host or "127.0.0.1", parsed.port or _DEFAULT_PORT)
        near = parsed.set(host="127.0.0.1", port=proxy.port)
        self.place = near.render_as_string(hide_password=False)
        self.hangs, self.close = proxy.hangs, proxy.close
