"""Transactions on the database of a gallery, in SQLite or PostgreSQL, and its encryption."""

from __future__ import annotations

import logging
import math
import sqlite3
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa
from sqlalchemy.exc import ArgumentError, DBAPIError

from fpmatch.base.folders import create_private
from fpmatch.errors import EncryptionError, GalleryError
from fpmatch.gallery.listing.manifest import SQLITE_HEADER
from fpmatch.gallery.store.sealing import read_sealing
from fpmatch.gallery.store.tables import TABLES

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from fpmatch.gallery.encryption.keys import KeyRing
    from fpmatch.gallery.store.sealing import Sealing

BUSY_S: Final = 60.0  # to wait for another program that holds a file, or for a server
CONNECT_S: Final = 10  # to wait for a connection to a server
ROWS_PER_READ: Final = 1000
_REASONS: Final = {
    "SQLITE_FULL": "the disk is full",
    "SQLITE_READONLY": "cannot be written: it, or its folder, is read-only",
    "SQLITE_CANTOPEN": "cannot be opened: no permission, or no such folder",
    "SQLITE_NOTADB": "not a gallery",
    "SQLITE_CORRUPT": "damaged",
    "SQLITE_IOERR": "cannot be read or written (disk I/O error)",
}
_LOCK: Final = 0x66706D61746368  # "fpmatch", of those who write, on a PostgreSQL server
_LATE: Final = {"57014", "55P03"}  # of PostgreSQL: a statement, or a lock, took too long
_POOL: Final = "fpmatch"
_SECRETS: Final = ("password", "sslpassword", "passfile")  # in the query of a URL


class Database:
    """Open transactions on the database of one gallery.

    `where` is a file, made if missing and `create`, or a URL ``postgresql://user@host/database``,
    and `name` is either, without a password. A statement that has waited
    for `patience` seconds raises GalleryError (code "late"). Templates are opened with `key`: keys,
    or their source. Raises GalleryError if there is no such file, it is no SQLite database, or the
    URL is of another kind.
    """

    def __init__(
        self,
        where: str | os.PathLike[str],
        *,
        create: bool = False,
        key: KeyRing | str | None = None,
        patience: float | None = None,
    ) -> None:
        url, self.where, self.key = _as_url(where), str(where), key
        self._patience = BUSY_S if patience is None else patience
        self.file: Path | None = None
        self.damaged: dict[int, str] = {}
        """Why entries are damaged that were skipped, by their numbers."""
        if isinstance(url, Path):
            self.name, self.file = str(url), url
            _check_file(url, create=create)
            self._engine = _sqlite(url, create=create, patience=self._patience)
        else:
            self.name = _without_secrets(url)
            self._engine = _postgresql(url, self._patience)
        sa.event.listen(self._engine, "begin", _begin)

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()

    def error(self, message: str, code: str = "") -> GalleryError:
        """Return an error that names this database."""
        return GalleryError(message, path=self.name, code=code)

    @contextmanager
    def reading(self) -> Iterator[sa.Connection]:
        """Open a transaction that reads; every error is a GalleryError."""
        with self.naming_errors(), self._engine.connect() as connection:
            yield connection

    @contextmanager
    def changing(self) -> Iterator[sa.Connection]:
        """Open a transaction, committed unless the block raises, during which no other one writes.

        On SQLite this is the only one that writes; on PostgreSQL others wait for the row that each
        locks, or for a lock of the whole database while there is no gallery in it.
        """
        writer = self._engine.execution_options(writes=True)
        with self.naming_errors(), writer.connect() as connection, connection.begin():
            if self.file is None:
                connection.execute(sa.select(sa.func.pg_advisory_xact_lock(_LOCK)))
            yield connection

    def pages(
        self, query: sa.Select[Any], number: sa.Column[int]
    ) -> Iterator[tuple[Sequence[Any], Sealing | None]]:
        """Yield rows by ascending `number`, their first column, and how templates are sealed.

        Each thousand are read in one transaction, so that no other is blocked for long.
        """
        further = query = query.order_by(number).limit(ROWS_PER_READ)
        numbers: list[int] = []
        while True:
            with self.reading() as connection:
                rows = connection.execute(further).all()
                sealing = self.sealing(connection)
            numbers = [*numbers[-1:], *(row[0] for row in rows)]
            if any(one >= other for one, other in pairwise(numbers)):
                raise self.error("damaged: its rows are not in order", "damaged")
            yield rows, sealing
            if len(rows) < ROWS_PER_READ:
                return
            further = query.where(number > numbers[-1])

    def vacuum(self) -> None:
        """Rewrite the database, or the tables of galleries on PostgreSQL, without free space.

        No other program may use it meanwhile. A killed or failed run leaves it as it was.
        """
        plain = self._engine.execution_options(isolation_level="AUTOCOMMIT", autocommit=True)
        with self.naming_errors(), plain.connect() as connection:
            if self.file is None:
                connection.exec_driver_sql(f"SET lock_timeout = {round(self._patience * 1000)}")
                connection.exec_driver_sql("SET statement_timeout = 0")
                names = ", ".join(table.name for table in TABLES)
                connection.exec_driver_sql(f"VACUUM (FULL, ANALYZE) {names}")
                connection.invalidate()  # its limits are not the limits of the pool
            else:
                connection.exec_driver_sql("VACUUM")

    def sealing(self, connection: sa.Connection | None = None) -> Sealing | None:
        """Return how this gallery is encrypted now; None if it is not."""
        if connection is None:
            with self.reading() as own:
                return self.sealing(own)
        return read_sealing(connection, self.key)

    def check_keys(self) -> None:
        """Raise GalleryError (code "missing key") unless the key in use was given."""
        with self.naming_errors():
            sealing = self.sealing()
            assert sealing is None or sealing.key

    @contextmanager
    def naming_errors(self) -> Iterator[None]:
        """Turn errors of the database, and about keys, into errors that name this gallery."""
        try:
            yield
        except EncryptionError as error:
            if error.code not in {"missing key", "damaged"}:
                raise
            raise self.error(str(error), error.code) from error
        except DBAPIError as error:
            if _is_late(error):
                what = "no answer" if self.file is None else "another program has held it"
                why = f"{what} for more than {self._patience:g} seconds"
                raise self.error(why, "late") from error
            raise self.error(_reason(error), "database") from error
        except UnicodeDecodeError as error:  # of a message about a damaged schema, too
            raise self.error("damaged: its text is not UTF-8", "damaged") from error
        except OverflowError as error:  # of an int that SQLite cannot take
            raise self.error("no entry has so large a number", "unknown") from error
        except UnicodeError as error:  # of the name of a host, too
            raise self.error("a name that is no text for a database", "database") from error


def _as_url(where: str | os.PathLike[str]) -> Path | sa.URL:
    if not isinstance(where, str) or "://" not in where:
        return Path(where)
    try:
        url = sa.make_url(where)
    except (ArgumentError, ValueError) as error:
        raise GalleryError("gallery: not a URL of the form postgresql://host/database") from error
    if url.drivername.partition("+")[0] not in {"postgres", "postgresql"}:
        raise GalleryError(
            "galleries are SQLite files or PostgreSQL databases (postgresql://host/database)",
            path=_without_secrets(url),
        )
    return url.set(drivername="postgresql")


def _without_secrets(url: sa.URL) -> str:
    """Return a URL as it may be shown."""
    return url.difference_update_query(_SECRETS).render_as_string(hide_password=True)


def _check_file(path: Path, *, create: bool) -> None:
    """Refuse a path that is no SQLite file, or is missing and may not be made."""
    why = code = ""
    try:
        if path.is_file():
            with path.open("rb") as stream:
                head = stream.read(len(SQLITE_HEADER))
            if head != SQLITE_HEADER and not (create and not head):
                why = "not a gallery" if head else "not a gallery: the file is empty"
                code = "no gallery"
        elif path.exists():
            what = "a folder" if path.is_dir() else "not a regular file"
            why, code = f"is {what}, not a gallery", "no gallery"
        elif not create:
            why, code = "no such gallery; `fpmatch enrol` makes one", "missing"
        elif not path.parent.is_dir():
            why, code = "cannot be made: no such folder", "missing folder"
        else:
            create_private(path)  # SQLite gives its journal the same rights
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
    if why:
        raise GalleryError(why, path=path, code=code)


def _sqlite(path: Path, *, create: bool, patience: float) -> sa.Engine:
    uri = f"{path.absolute().as_uri()}?mode={'rwc' if create else 'rw'}"

    def connect() -> sqlite3.Connection:
        # isolation_level None: transactions begin in `_begin` only
        connection = sqlite3.connect(uri, uri=True, timeout=patience, isolation_level=None)
        connection.text_factory = _text
        connection.execute("PRAGMA secure_delete = ON")  # overwrites what is deleted
        return connection

    how: dict[str, Any] = {"poolclass": sa.NullPool, "pool_logging_name": _POOL}
    engine = sa.create_engine("sqlite+pysqlite://", creator=connect, **how)
    # that Ctrl-C came while a connection was closed is raised, too
    logging.getLogger(f"sqlalchemy.pool.impl.NullPool.{_POOL}").setLevel(logging.CRITICAL)
    return engine


def _postgresql(url: sa.URL, patience: float) -> sa.Engine:
    """Return an engine whose driver, and whose server, wait no longer for a connection or a lock.

    Raises GalleryError if psycopg is not installed.
    """
    limit_ms = round(patience * 1000)
    options = f"{url.query.get('options', '')} -c statement_timeout={limit_ms}".strip()
    limits = {
        "connect_timeout": math.ceil(min(CONNECT_S, patience)),
        "tcp_user_timeout": limit_ms,
        "options": options,
    }
    chosen = url.set(drivername="postgresql+psycopg")
    try:
        return sa.create_engine(chosen, connect_args=limits, pool_pre_ping=True)
    except ImportError as error:
        raise GalleryError(
            "a gallery on PostgreSQL needs psycopg: pip install 'fpmatch[postgres]'"
        ) from error


def _text(data: bytes) -> str | bytes:
    """Return the text of a cell; the bytes of one that is damaged."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data


def _begin(connection: sa.Connection) -> None:
    options = connection.get_execution_options()
    if connection.dialect.name == "sqlite" and not options.get("autocommit", False):
        connection.exec_driver_sql("BEGIN IMMEDIATE" if options.get("writes", False) else "BEGIN")


def _is_late(error: DBAPIError) -> bool:
    """Return whether the database was held, or silent, for longer than may be waited."""
    busy = str(getattr(error.orig, "sqlite_errorname", "")).startswith("SQLITE_BUSY")
    silent = type(error.orig).__name__ == "ConnectionTimeout"  # of psycopg, which is an extra
    return busy or silent or getattr(error.orig, "sqlstate", None) in _LATE


def _reason(error: DBAPIError) -> str:
    """Return the reason of a failure on one line."""
    original: Any = error.orig
    name = getattr(original, "sqlite_errorname", "")
    for prefix, known in _REASONS.items():
        if name.startswith(prefix):
            return known
    message = getattr(getattr(original, "diag", None), "message_primary", None)
    lines = str(message or original).splitlines()
    return lines[0].strip() if lines else type(original).__name__
