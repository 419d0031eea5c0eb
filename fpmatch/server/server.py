"""The server: its socket, its address, and hypercorn behind it."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import os
import secrets
import signal
import socket
import threading
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any, Final, cast

from hypercorn.asyncio import serve as serve_app
from hypercorn.config import Config

from fpmatch.base.output import reason
from fpmatch.server.access import HEADER_BYTES
from fpmatch.server.app import make_app
from fpmatch.server.settings import Client, Role, SettingsError, check_token, digest_of
from fpmatch.server.watch import set_up_logging

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from starlette.types import ASGIApp

    from fpmatch.server.settings import Limits, Settings

_BACKLOG: Final = 128  # connections that wait to be accepted
_START_S: Final = 150  # for the worker processes to start
_GRACE_S: Final = 5  # for requests to end when the server is stopped
_log: Final = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class BoundServer:
    """A listening socket, its address for browsers, and settings with hosts and clients."""

    listener: socket.socket
    address: str
    settings: Settings


def bind_server(
    host: str,
    port: int,
    settings: Settings,
    *,
    token: str | None = None,
    allowed_hosts: Sequence[str] = (),
) -> BoundServer:
    """Listen on a host and a port (0: any that is free); connections wait until `serve` answers.

    The `token` is that of a client that may request everything; if other machines can reach the
    host, and there is neither a token nor a client, a random one is made. `allowed_hosts` are other
    names of this server in requests.
    """
    if token is not None:
        check_token(token)
    where = f"cannot listen on {host}, port {port}"
    if not 0 <= port <= 65_535:
        raise SettingsError(f"{where}: ports go up to 65535", code="port")
    try:
        family, _, _, _, place = socket.getaddrinfo(
            host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.create_server(place[:2], family=family, backlog=_BACKLOG)
    except (OSError, UnicodeError) as error:
        why = reason(error) if isinstance(error, OSError) else "no such host"
        raise SettingsError(f"{where}: {why}", code="listen") from error
    own, bound = listener.getsockname()[:2]
    local = ipaddress.ip_address(own).is_loopback
    if not local and token is None and not settings.clients:
        token = secrets.token_urlsafe(24)
    owner = {} if token is None else {digest_of(token): Client("owner", Role.ADMIN)}
    own_name = socket.gethostname().lower()
    shown = f"[{host}]" if ":" in host else host
    if ipaddress.ip_address(own).is_unspecified:
        shown = own_name
    known = {shown, *allowed_hosts, *(settings.hosts if local else ("localhost", own_name))}
    fragment = "" if token is None else f"#token={token}"
    hosts = tuple(sorted(name.lower() for name in known))
    return BoundServer(
        listener,
        f"http://{shown}:{bound}/{fragment}",
        replace(settings, hosts=hosts, clients={**settings.clients, **owner}),
    )


def serve(
    bound: BoundServer, *, log: str = "none", ready: Callable[[], None] = lambda: None
) -> None:
    """Answer requests until SIGINT or SIGTERM; `ready` is called once, when they are answered.

    `log` is the format of the log, as for `fpmatch.server.watch.set_up_logging`.
    """
    set_up_logging(log)
    app = make_app(bound.settings, ready)

    async def main() -> None:
        stop, loop = asyncio.Event(), asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            with suppress(NotImplementedError):  # Windows: KeyboardInterrupt ends the server
                loop.add_signal_handler(number, stop.set)
        await answer(app, bound.listener, bound.settings.limits, stop)

    # Ctrl-C reaches the whole process group, SIGTERM of a service manager perhaps, and the server
    # stops its workers: they inherit that the main thread receives none, and another thread
    # receives it for this process
    masks = {signal.SIGINT, signal.SIGTERM} if hasattr(signal, "pthread_sigmask") else set()
    if masks:
        resource_tracker.ensure_running()  # it ends the mask of the thread that starts it
        threading.Thread(target=threading.Event().wait, daemon=True).start()
        signal.pthread_sigmask(signal.SIG_BLOCK, masks)
    try:
        asyncio.run(main())
    finally:
        if masks:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, masks)


async def answer(
    app: ASGIApp, listener: socket.socket, limits: Limits, stop: asyncio.Event
) -> None:
    """Answer requests that come to a socket, until an event; those that are inside may end."""
    config = Config()
    config.bind = [f"fd://{os.dup(listener.fileno())}"]
    config.backlog = _BACKLOG
    config.keep_alive_timeout = limits.slow_seconds  # also until the first header is whole
    # of a silent client, whatever it waits for: hypercorn itself keeps a refused web socket open
    config.read_timeout = round(limits.wait_seconds + limits.seconds + 3 * limits.slow_seconds)
    config.h11_max_incomplete_size = HEADER_BYTES
    config.graceful_timeout = _GRACE_S
    config.startup_timeout = _START_S
    config.include_server_header = False
    config.errorlog = None  # the application logs its errors
    if hasattr(socket, "TCP_USER_TIMEOUT"):  # of an answer that is not read
        milliseconds = round(1000 * limits.slow_seconds)
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, milliseconds)
    asyncio.get_running_loop().set_exception_handler(_on_error_of_loop)
    serving = asyncio.create_task(serve_app(cast("Any", app), config, shutdown_trigger=stop.wait))
    stopping = asyncio.create_task(stop.wait())
    await asyncio.wait([serving, stopping], return_when=asyncio.FIRST_COMPLETED)
    await asyncio.wait([serving], timeout=_GRACE_S + 1)
    if serving.cancel():  # hypercorn waits longer for connections from Python 3.12 on
        await asyncio.wait([serving])
    else:
        serving.result()


def _on_error_of_loop(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Log one line where asyncio would log a traceback for a connection that broke."""
    error = context.get("exception")
    while isinstance(error, BaseExceptionGroup):
        error = error.exceptions[0]
    if isinstance(error, OSError):
        _log.info("a connection ended: %s", error.strerror)
    else:
        loop.default_exception_handler(context)
