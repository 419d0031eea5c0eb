"""Open the door: the socket, the address that people open, and the server behind it."""

from __future__ import annotations

import ipaddress
import secrets
import socket
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from fpmatch.errors import FpmatchError
from fpmatch.output import reason

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from fpmatch.web.settings import Settings

_BACKLOG: Final = 128
_TOKEN_BYTES: Final = 24
_LEAST_TOKEN: Final = 16  # letters
_LAST_PORT: Final = 65_535
_GRACE_S: Final = 5  # that requests have to end in when the server is told to


class ServeError(FpmatchError):
    """A server cannot be opened where it was asked for."""


@dataclass(frozen=True, slots=True)
class BoundServer:
    """Hold an open socket, and the address under which people find it.

    Parameters
    ----------
    listener : socket
        Bound and listening.
    address : str
        What to open in a browser, with the token where there is one.
    settings : Settings
        Those given, with the hosts and the token that go with the socket.
    """

    listener: socket.socket
    address: str
    settings: Settings


def bind_server(
    host: str,
    port: int,
    settings: Settings,
    *,
    token: str | None = None,
    names: Sequence[str] = (),
) -> BoundServer:
    """Listen on a host and port.

    Parameters
    ----------
    host : str
        Name or address; one that others can reach makes a token necessary.
    port : int
        0 for any that is free.
    settings : Settings
        What the server is told else.
    token : str, optional
        The word that requests must bring (default: one made up where others can reach the host,
        else none).
    names : sequence of str
        Other names under which the server may be asked for.

    Returns
    -------
    BoundServer
        Who connects from now on, waits until `serve` answers.

    Raises
    ------
    ServeError
        If the host is unknown, the port taken, or the token too short.
    """
    if token is not None and len(token) < _LEAST_TOKEN:
        raise ServeError(f"a token must have {_LEAST_TOKEN} letters at least")
    if token is not None and not (token.isascii() and token.isprintable() and " " not in token):
        raise ServeError("a token is made of ASCII letters without spaces")
    if not 0 <= port <= _LAST_PORT:
        raise ServeError(f"cannot listen on {host}, port {port}: ports go up to {_LAST_PORT}")
    try:
        family, _, _, _, place = socket.getaddrinfo(
            host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.create_server(place[:2], family=family, backlog=_BACKLOG)
    except (OSError, UnicodeError) as error:
        why = reason(error) if isinstance(error, OSError) else "no such host"
        raise ServeError(f"cannot listen on {host}, port {port}: {why}") from error
    own, bound = listener.getsockname()[:2]
    alone = ipaddress.ip_address(own).is_loopback
    if not alone and token is None:
        token = secrets.token_urlsafe(_TOKEN_BYTES)
    shown = _shown(host, own)
    known = {*settings.hosts, shown, *names} if alone else {"localhost", shown, *names, _own_name()}
    fragment = "" if token is None else f"#token={token}"
    hosts = tuple(sorted(name.lower() for name in known))
    return BoundServer(
        listener,
        f"http://{shown}:{bound}/{fragment}",
        replace(settings, hosts=hosts, token=token),
    )


def serve(door: BoundServer, *, ready: Callable[[], None] = lambda: None) -> None:
    """Answer requests until the process is told to stop (SIGINT, SIGTERM).

    Parameters
    ----------
    door : BoundServer
        From `bind_server`.
    ready : callable
        Called once, when requests are answered.
    """
    import uvicorn  # noqa: PLC0415

    from fpmatch.web.app import make_app  # noqa: PLC0415

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            ready()

    config = uvicorn.Config(
        make_app(door.settings),
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=_GRACE_S,
    )
    Server(config).run(sockets=[door.listener])


def _shown(host: str, own: str) -> str:
    """Return the name that people are told."""
    if ipaddress.ip_address(own).is_unspecified:
        return _own_name()
    return f"[{host}]" if ":" in host else host


def _own_name() -> str:
    return socket.gethostname().lower()
