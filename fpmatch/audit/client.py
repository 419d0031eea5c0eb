"""Who requests what is done: a client of a server, or the user of a command."""

from __future__ import annotations

import os
import platform
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Final, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

Result = TypeVar("Result")

OPERATOR: Final = "FPMATCH_OPERATOR"  # environment variable: who uses the commands
_client: ContextVar[str | None] = ContextVar("fpmatch_client", default=None)


@contextmanager
def acting_as(client: str) -> Iterator[None]:
    """Name who requests what is done inside the block.

    Examples
    --------
    >>> with acting_as("ada"):
    ...     current_client()
    'ada'
    """
    token = _client.set(client)
    try:
        yield
    finally:
        _client.reset(token)


def act_as(client: str, work: Callable[..., Result], *args: Any) -> Result:
    """Return ``work(*args)``, done for a client; for other processes."""
    with acting_as(client):
        return work(*args)


def current_client() -> str:
    """Return who requests this: of `acting_as`, else $FPMATCH_OPERATOR, else user and host."""
    if (named := _client.get()) is not None:
        return named
    system = f"{_system_user()}@{platform.node() or 'localhost'}"
    operator = os.environ.get(OPERATOR, "").strip()
    return f"{operator} ({system})" if operator else system


def _system_user() -> str:
    """Return the user of this process as the system has it, not its environment."""
    try:
        import pwd  # noqa: PLC0415  (not on Windows)

        return pwd.getpwuid(os.getuid()).pw_name
    except (ImportError, KeyError):
        import getpass  # noqa: PLC0415

        with suppress(Exception):
            return getpass.getuser()
        return str(os.getuid()) if hasattr(os, "getuid") else "unknown"
