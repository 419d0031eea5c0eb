"""The running server: uvicorn with bounds on connections, and with few open files."""

from __future__ import annotations

import asyncio
import ctypes
import errno
import logging
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Final, cast

import uvicorn

from fpmatch.server.connections import Connection, Connections

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from fpmatch.server.observer import Observer
    from fpmatch.server.settings import Settings

_GRACE_S: Final = 5  # for requests to end when the server is stopped
_PAUSE_S: Final = 0.5  # between two looks at all connections
_ACCEPTED: Final = 32  # at most, of those that wait, at a time
_WAITING: Final = 128  # connections that wait to be accepted
_RESERVED_FILES: Final = 32  # for the log, the event loop and galleries
_FILES_OF_WORKER: Final = 4
_FILES_OF_CONNECTION: Final = 2  # its socket, and a large upload
_FEWEST: Final = 8
_SHORT: Final = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_M_MMAP_THRESHOLD: Final = -3  # of mallopt, in malloc.h of glibc
_LARGE_BYTES: Final = 1 << 16
_log: Final = logging.getLogger(__name__)


class Server(uvicorn.Server):
    """A uvicorn server that closes late connections, and states when it is ready."""

    def __init__(
        self, config: uvicorn.Config, connections: Connections, ready: Callable[[], None]
    ) -> None:
        super().__init__(config)
        self._connections = connections
        self._ready = ready
        self._looking: asyncio.Task[None] | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to answer requests."""
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(_on_error_of_loop)
        _return_large_blocks()
        await super().startup(sockets)
        for one in sockets or ():
            one.listen(_WAITING)  # asyncio has set this to what it accepts at a time
        self._looking = loop.create_task(self._look())
        self._ready()

    async def _look(self) -> None:
        while True:
            await asyncio.sleep(_PAUSE_S)
            self._connections.close_late()


def make_server(
    app: Observer, settings: Settings, ready: Callable[[], None] = lambda: None
) -> Server:
    """Return a server of an application; `ready` is called when it answers."""
    most = min(settings.limits.connections, _connections_of_files(settings))
    connections = Connections(settings.limits, most, app.registry)
    config = uvicorn.Config(
        app,
        http=cast("type[asyncio.Protocol]", partial(Connection, connections)),
        ws="none",
        log_config=None,
        access_log=False,
        server_header=False,
        backlog=_ACCEPTED,
        timeout_graceful_shutdown=_GRACE_S,
    )
    return Server(config, connections, ready)


def _connections_of_files(settings: Settings) -> int:
    """Return how many connections the limit of open files allows; it is raised where it can be."""
    try:
        import resource  # noqa: PLC0415
    except ImportError:  # systems without such a limit
        return settings.limits.connections
    reserved = _RESERVED_FILES + _ACCEPTED + _FILES_OF_WORKER * settings.processes
    wanted = reserved + _FILES_OF_CONNECTION * settings.limits.connections
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if resource.RLIM_INFINITY not in (soft, hard):
        wanted = min(wanted, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        soft = wanted
    if soft == resource.RLIM_INFINITY:
        return settings.limits.connections
    return max(_FEWEST, (soft - reserved) // _FILES_OF_CONNECTION)


def _return_large_blocks() -> None:
    """Let the system have large blocks back as soon as they are freed, where the library is glibc.

    It raises its threshold when the first of them is freed, and keeps later ones: an answer of
    megabytes would leave a gap of that size for each connection that was closed.
    """
    with suppress(OSError, AttributeError, TypeError):  # another library, or Windows
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)


def _on_error_of_loop(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log one line where asyncio would log a traceback for each connection that it cannot accept.

    asyncio tries again a second later.
    """
    error = context.get("exception")
    if isinstance(error, OSError) and error.errno in _SHORT:
        _log.warning("connections wait to be accepted: %s", error.strerror)
    else:
        loop.default_exception_handler(context)
