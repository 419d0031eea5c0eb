"""Where a gallery lies, a SQLite file or a PostgreSQL database, and how transactions go there."""

from __future__ import annotations

import sqlite3
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa
from sqlalchemy.exc import ArgumentError, DBAPIError

from fpmatch.errors import GalleryError

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

BUSY_S: Final = 60.0  # that another program may keep a SQLite file to itself
CONNECT_S: Final = 10  # that a server may take to answer
_SQLITE_HEADER: Final = b"SQLite format 3\0"
_SQLITE_REASONS: Final = {
    "SQLITE_FULL": "the disk is full",
    "SQLITE_READONLY": "cannot be written: it, or its folder, is read-only",
    "SQLITE_CANTOPEN": "cannot be opened: no permission, or no such folder",
    "SQLITE_BUSY": f"another program has kept it to itself for more than {BUSY_S:g} seconds",
    "SQLITE_NOTADB": "not a gallery",
    "SQLITE_CORRUPT": "damaged",
    "SQLITE_IOERR": "cannot be read or written (disk I/O error)",
}
_SECRETS: Final = ("password", "sslpassword", "passfile")  # that a URL's query may hold
_CREATION_LOCK: Final = 0x66706D61746368  # "fpmatch": nobody else's on a PostgreSQL server


class DamagedRowError(ValueError):
    """A row holds what was never written; within a transaction it becomes a GalleryError."""


class DatabaseUrl:
    """Open transactions on the database of one gallery.

    Parameters
    ----------
    where : str or path-like
        A file, or a URL ``postgresql://user@host/database`` (or ``sqlite:///file``).
    create : bool
        Whether a SQLite file may be made.

    Raises
    ------
    GalleryError
        If there is no such file, it is no SQLite database, or the URL is of another kind.
    """

    def __init__(self, where: str | os.PathLike[str], *, create: bool = False) -> None:
        url = _as_url(where)
        self.file: Path | None = None
        if isinstance(url, Path):
            self.name, self.file = str(url), url
            _check_file(url, create=create)
            self._engine = _sqlite(url, create=create)
        else:
            self.name = _without_secrets(url)
            self._engine = _postgresql(url.set(drivername="postgresql+psycopg"))
        sa.event.listen(self._engine, "begin", _begin)

    def close(self) -> None:
        """Let go of the database."""
        self._engine.dispose()

    @contextmanager
    def reading(self) -> Iterator[sa.Connection]:
        """Open a transaction that reads; every error is one line."""
        with self._worded(), self._engine.connect() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[sa.Connection]:
        """Open a transaction that writes, alone; it is committed where the block ends well.

        On PostgreSQL the block itself must see to being alone, by the lock of a row.
        """
        alone = self._engine.execution_options(writes=True)
        with self._worded(), alone.connect() as connection, connection.begin():
            yield connection

    @contextmanager
    def creating(self) -> Iterator[sa.Connection]:
        """Open a transaction as `writing` does, alone with those that create galleries."""
        with self.writing() as connection:
            if self.file is None:
                connection.execute(sa.select(sa.func.pg_advisory_xact_lock(_CREATION_LOCK)))
            yield connection

    @contextmanager
    def _worded(self) -> Iterator[None]:
        try:
            yield
        except DamagedRowError as error:
            raise GalleryError(f"{self.name}: damaged: {error}") from error
        except DBAPIError as error:
            raise GalleryError(f"{self.name}: {_reason(error)}") from error


def _as_url(where: str | os.PathLike[str]) -> Path | sa.URL:
    if not isinstance(where, str) or "://" not in where:
        return Path(where)
    try:
        url = sa.make_url(where)
    except (ArgumentError, ValueError) as error:
        raise GalleryError("gallery: not a URL of the form postgresql://host/database") from error
    kind = url.drivername.partition("+")[0]
    if kind == "sqlite" and url.database:
        return Path(url.database)
    if kind not in {"postgres", "postgresql"}:
        raise GalleryError(
            f"{_without_secrets(url)}: galleries are SQLite files or "
            "PostgreSQL databases (postgresql://host/database)"
        )
    return url.set(drivername="postgresql")


def _without_secrets(url: sa.URL) -> str:
    """Return a URL as it may be shown."""
    return url.difference_update_query(_SECRETS).render_as_string(hide_password=True)


def _check_file(path: Path, *, create: bool) -> None:
    """Refuse a path that is no SQLite file, or is not there and may not be made."""
    try:
        if path.is_dir():
            raise GalleryError(f"{path}: is a folder, not a gallery")
        if not path.exists():
            if not create:
                raise GalleryError(f"{path}: no such gallery; `fpmatch enrol` makes one")
            if not path.parent.is_dir():
                raise GalleryError(f"{path}: cannot be made: no such folder")
            return
        with path.open("rb") as stream:
            head = stream.read(len(_SQLITE_HEADER))
    except (OSError, ValueError) as error:
        raise GalleryError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    if head != _SQLITE_HEADER and not (create and not head):
        raise GalleryError(f"{path}: not a gallery{'' if head else ': the file is empty'}")


def _sqlite(path: Path, *, create: bool) -> sa.Engine:
    uri = f"{path.absolute().as_uri()}?mode={'rwc' if create else 'rw'}"

    def connect() -> sqlite3.Connection:
        # isolation_level None: transactions begin where we say so
        return sqlite3.connect(uri, uri=True, timeout=BUSY_S, isolation_level=None)

    return sa.create_engine("sqlite+pysqlite://", creator=connect, poolclass=sa.NullPool)


def _postgresql(url: sa.URL) -> sa.Engine:
    try:
        return sa.create_engine(
            url, connect_args={"connect_timeout": CONNECT_S}, pool_pre_ping=True
        )
    except ImportError as error:
        raise GalleryError(
            "a gallery on PostgreSQL needs psycopg: pip install 'fpmatch[postgres]'"
        ) from error


def _begin(connection: sa.Connection) -> None:
    if connection.dialect.name == "sqlite":
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _reason(error: DBAPIError) -> str:
    """Return what went wrong, in words, on one line."""
    original: Any = error.orig
    name = getattr(original, "sqlite_errorname", "")
    for prefix, reason in _SQLITE_REASONS.items():
        if name.startswith(prefix):
            return reason
    message = getattr(getattr(original, "diag", None), "message_primary", None)
    lines = str(message or original).splitlines()
    return lines[0].strip() if lines else type(original).__name__
