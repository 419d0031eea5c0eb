"""Connections to PostgreSQL on which no call waits for ever: the server may be silent only so long.

The kernel of a host whose processes are stopped, and a proxy that has lost its server, go on
acknowledging what is sent: time limits of the server, or of TCP, do not end such a wait.
"""

from __future__ import annotations

import math
from time import monotonic
from typing import TYPE_CHECKING, Any, Final, TypeVar

import sqlalchemy as sa

from fpmatch.errors import GalleryError

if TYPE_CHECKING:
    from collections.abc import Generator

Result = TypeVar("Result")

CONNECT_S: Final = 10  # to wait for a server


def postgresql_engine(url: sa.URL, patience: float) -> sa.Engine:
    """Return an engine whose calls raise psycopg.errors.ConnectionTimeout after seconds of silence.

    Raises GalleryError if psycopg is not installed.
    """
    limits = {"connect_timeout": math.ceil(min(CONNECT_S, patience))}
    chosen = url.set(drivername="postgresql+psycopg")
    try:
        engine = sa.create_engine(chosen, connect_args=limits, pool_pre_ping=True)
    except ImportError as error:
        raise GalleryError(
            "a gallery on PostgreSQL needs psycopg: pip install 'fpmatch[postgres]'"
        ) from error
    connect = _connection_class(patience).connect
    sa.event.listen(engine, "do_connect", lambda _, __, words, named: connect(*words, **named))
    return engine


def wait_for_ever(connection: sa.Connection) -> None:
    """Let the calls on a connection wait for an answer however long the server works on it."""
    connection.connection.driver_connection.patience = math.inf  # type: ignore[union-attr]


def is_silence(error: BaseException | None) -> bool:
    """Return whether an error of a call is that the server has not answered in time."""
    from psycopg.errors import ConnectionTimeout  # noqa: PLC0415  (of an extra)

    return isinstance(error, ConnectionTimeout)


def _connection_class(seconds: float) -> Any:
    """Return the class of connections that are closed after so many seconds of silence."""
    from psycopg import Connection  # noqa: PLC0415  (of an extra)
    from psycopg.errors import ConnectionTimeout  # noqa: PLC0415

    class Patient(Connection[Any]):
        """A connection with a limit of the time in which the server says nothing."""

        patience = seconds

        def wait(self, gen: Any, *words: Any, **named: Any) -> Any:
            try:
                return super().wait(_heard(gen, self.patience), *words, **named)
            except TimeoutError:
                self.close()  # or the end of the transaction would wait again
                raise ConnectionTimeout("no answer") from None

    return Patient


def _heard(waiting: Generator[Any, Any, Result], patience: float) -> Generator[Any, Any, Result]:
    """Yield what psycopg waits for; TimeoutError where nothing comes for so many seconds.

    psycopg sends 0 each time that it has waited in vain for a part of a second.
    """
    since = monotonic()
    try:
        wanted = next(waiting)
        while True:
            ready = yield wanted
            if ready:
                since = monotonic()
            elif monotonic() - since > patience:
                raise TimeoutError
            wanted = waiting.send(ready)
    except StopIteration as end:
        result: Result = end.value
        return result
