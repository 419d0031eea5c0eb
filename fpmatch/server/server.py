"""The server: its socket, its address, and uvicorn behind it."""

from __future__ import annotations

import ipaddress
import secrets
import signal
import socket
import threading
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from fpmatch.base.output import reason
from fpmatch.errors import FpmatchError
from fpmatch.gallery.engine.processes import interrupt_kept_from_children
from fpmatch.server.settings import Client, Role, check_token, digest_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from fpmatch.server.settings import Settings

_BACKLOG: Final = 128  # connections that wait to be accepted
_TOKEN_BYTES: Final = 24
_LAST_PORT: Final = 65_535


class ServeError(FpmatchError):
    """A server cannot be started on a host and port."""


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
    if not 0 <= port <= _LAST_PORT:
        raise ServeError(f"{where}: ports go up to {_LAST_PORT}", code="port")
    try:
        family, _, _, _, place = socket.getaddrinfo(
            host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.create_server(place[:2], family=family, backlog=_BACKLOG)
    except (OSError, UnicodeError) as error:
        why = reason(error) if isinstance(error, OSError) else "no such host"
        raise ServeError(f"{where}: {why}", code="listen") from error
    own, bound = listener.getsockname()[:2]
    local = ipaddress.ip_address(own).is_loopback
    if not local and token is None and not settings.clients:
        token = secrets.token_urlsafe(_TOKEN_BYTES)
    owner = {} if token is None else {digest_of(token): Client("owner", Role.ADMIN)}
    shown, own_name = _shown(host, own), socket.gethostname().lower()
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

    `log` is the format of the log, as for `fpmatch.server.logs.set_up_logging`.
    """
    from fpmatch.server.app import make_app  # noqa: PLC0415
    from fpmatch.server.logs import set_up_logging  # noqa: PLC0415
    from fpmatch.server.running import make_server  # noqa: PLC0415

    set_up_logging(log)
    server = make_server(make_app(bound.settings), bound.settings, ready)
    with interrupt_kept_from_children(), _ended_by_sigterm():  # the server stops its workers
        server.run(sockets=[bound.listener])


@contextmanager
def _ended_by_sigterm() -> Iterator[None]:
    """Let SIGTERM end the process with status 0; uvicorn sends it again when it has stopped."""

    def end(*_: object) -> None:
        raise SystemExit(0)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    former = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, former)


def _shown(host: str, own: str) -> str:
    """Return the host as the printed address has it."""
    if ipaddress.ip_address(own).is_unspecified:
        return socket.gethostname().lower()
    return f"[{host}]" if ":" in host else host
