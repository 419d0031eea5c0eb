"""Transactions on the database of a gallery: a SQLite file or a PostgreSQL database."""

from __future__ import annotations

import sqlite3
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import sqlalchemy as sa
from sqlalchemy.exc import ArgumentError, DBAPIError

from fpmatch.base.folders import create_private, make_private
from fpmatch.base.output import reason
from fpmatch.errors import GalleryError
from fpmatch.gallery.listing.kinds import SQLITE_HEADER
from fpmatch.gallery.store.postgresql import is_silence, postgresql_engine, wait_for_ever
from fpmatch.printable import printable

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence
    from logging import Logger, LogRecord

BUSY_S: Final = 60.0  # to wait for another program that holds a file, or for a silent server
_SQLITE_REASONS: Final = {
    "SQLITE_FULL": "the disk is full",
    "SQLITE_READONLY": "cannot be written: it, or its folder, is read-only",
    "SQLITE_CANTOPEN": "cannot be opened: no permission, or no such folder",
    "SQLITE_NOTADB": "not a gallery",
    "SQLITE_CORRUPT": "damaged",
    "SQLITE_IOERR": "cannot be read or written (disk I/O error)",
}
_SECRETS: Final = ("password", "sslpassword", "passfile")  # in the query of a URL
_CREATION_LOCK: Final = 0x66706D61746368  # "fpmatch", on a PostgreSQL server


class DamagedRowError(ValueError):
    """The row of an entry has impossible content; for one entry it becomes a GalleryError."""

    def __init__(self, number: object, why: str) -> None:
        self.number, self.why = number, why
        super().__init__(f"entry {number}: {why}")


class Database:
    """Open transactions on the database of one gallery.

    `where` is a file, made if missing and `create`, or a URL ``postgresql://user@host/database``
    (or ``sqlite:///file``), and `name` is either, without a password. A call that has waited for
    `patience` seconds raises GalleryError (code "late"). Raises GalleryError if there is no such
    file, it is no SQLite database, or the URL is of another kind.
    """

    def __init__(
        self, where: str | os.PathLike[str], *, create: bool = False, patience: float | None = None
    ) -> None:
        url, self.where = _as_url(where), str(where)
        self._patience = BUSY_S if patience is None else patience
        self.file: Path | None = None
        self._narrowed = False
        self.private = True  # whether only the owner may read the file; known after a change
        if isinstance(url, Path):
            self.name, self.file = str(url), url
            _check_file(url, create=create)
            self._engine = _sqlite(url, create=create, patience=self._patience)
        else:
            self.name = _without_secrets(url)
            self._engine = postgresql_engine(url, self._patience)
        sa.event.listen(self._engine, "begin", _begin)
        cast("Logger", self._engine.pool.logger).addFilter(_states_no_interrupt)

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()

    def error(self, message: str, code: str = "") -> GalleryError:
        """Return an error that names this database."""
        return GalleryError(message, path=self.name, code=code)

    @contextmanager
    def reading(self) -> Iterator[sa.Connection]:
        """Open a transaction that reads; every error is a GalleryError."""
        with self._translating_errors(), self._engine.connect() as connection:
            yield connection

    @contextmanager
    def writing(self) -> Iterator[sa.Connection]:
        """Open a transaction that writes, committed unless the block raises.

        On SQLite no other transaction writes meanwhile; on PostgreSQL the block must lock a row.
        """
        if self.file is not None and not self._narrowed:
            self._narrowed = True
            self.private = make_private(self.file)
        writer = self._engine.execution_options(writes=True)
        with self._translating_errors(), writer.connect() as connection, connection.begin():
            yield connection

    @contextmanager
    def creating(self) -> Iterator[sa.Connection]:
        """Open a transaction as `writing` does, in which no other gallery is created."""
        with self.writing() as connection:
            if self.file is None:
                connection.execute(sa.select(sa.func.pg_advisory_xact_lock(_CREATION_LOCK)))
            yield connection

    def vacuum(self, tables: Sequence[sa.Table]) -> None:
        """Rewrite the database, or its `tables` on PostgreSQL, without what was removed.

        No other program may use it meanwhile. A killed or failed run leaves it as it was.
        """
        with self.outside_transactions() as connection:
            if self.file is None:
                connection.exec_driver_sql(f"SET lock_timeout = {round(self._patience * 1000)}")
                wait_for_ever(connection)
                names = ", ".join(table.name for table in tables)
                connection.exec_driver_sql(f"VACUUM (FULL, ANALYZE) {names}")
            else:
                make_private(self.file)
                connection.exec_driver_sql("VACUUM")
                connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
                mark_overwritten(connection)

    def is_overwritten(self) -> bool:
        """Return whether all that was ever deleted from the file has been overwritten.

        It has not in one that a version up to 0.2 has made, until `vacuum`.
        """
        if self.file is None:
            return False
        with self.reading() as connection:
            return bool(connection.exec_driver_sql("PRAGMA user_version").scalar())

    def size(self, tables: Sequence[sa.Table]) -> int:
        """Return the bytes of the file, or of the `tables` on PostgreSQL with their indexes."""
        if self.file is not None:
            return self.file.stat().st_size
        with self.reading() as connection:
            sizes = [sa.func.pg_total_relation_size(table.name) for table in tables]
            return sum(map(int, connection.execute(sa.select(*sizes)).one()))

    @contextmanager
    def outside_transactions(self) -> Iterator[sa.Connection]:
        """Open a connection whose statements are no transaction, such as VACUUM."""
        plain = self._engine.execution_options(isolation_level="AUTOCOMMIT", autocommit=True)
        with self._translating_errors(), plain.connect() as connection:
            yield connection

    def structure_fault(self) -> str:
        """Return what is wrong with the tables and indices of a SQLite file; "" if nothing is."""
        if self.file is None:
            return ""
        with self.reading() as connection:
            answer = str(connection.exec_driver_sql("PRAGMA integrity_check(1)").scalar())
        return "" if answer == "ok" else printable(answer.splitlines()[-1].strip())

    @contextmanager
    def _translating_errors(self) -> Iterator[None]:
        try:
            yield
        except DamagedRowError as error:
            raise self.error(f"damaged: {error}", "damaged") from error
        except DBAPIError as error:
            if self._is_late(error):
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

    def _is_late(self, error: DBAPIError) -> bool:
        """Return whether the database was held, or silent, for longer than may be waited."""
        if self.file is None:
            return is_silence(error.orig)
        return str(getattr(error.orig, "sqlite_errorname", "")).startswith("SQLITE_BUSY")


def mark_overwritten(connection: sa.Connection) -> None:
    """Record that all that is deleted from a SQLite file is overwritten."""
    if connection.dialect.name == "sqlite":
        connection.exec_driver_sql("PRAGMA user_version = 1")


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
        if path.is_dir():
            why, code = "is a folder, not a gallery", "no gallery"
        elif path.exists() and not path.is_file():
            why, code = "is not a regular file, not a gallery", "no gallery"
        elif path.exists():
            with path.open("rb") as stream:
                head = stream.read(len(SQLITE_HEADER))
            if head != SQLITE_HEADER and not (create and not head):
                why = "not a gallery" if head else "not a gallery: the file is empty"
                code = "no gallery"
        elif not create:
            why, code = "no such gallery; `fpmatch enrol` makes one", "missing"
        elif not path.parent.is_dir():
            why, code = "cannot be made: no such folder", "missing folder"
    except (OSError, ValueError) as error:
        raise GalleryError(str(getattr(error, "strerror", None) or error), path=path) from error
    if why:
        raise GalleryError(why, path=path, code=code)


def _sqlite(path: Path, *, create: bool, patience: float) -> sa.Engine:
    if create and not path.exists():
        try:
            create_private(path)  # SQLite gives its journal the same rights
        except OSError as error:
            raise GalleryError(f"cannot be made: {reason(error)}", path=path) from error
    uri = f"{path.absolute().as_uri()}?mode={'rwc' if create else 'rw'}"

    def connect() -> sqlite3.Connection:
        # isolation_level None: transactions begin in `_begin` only
        connection = sqlite3.connect(uri, uri=True, timeout=patience, isolation_level=None)
        connection.text_factory = _text
        connection.execute("PRAGMA secure_delete = ON")  # overwrites what is deleted
        return connection

    return sa.create_engine("sqlite+pysqlite://", creator=connect, poolclass=sa.NullPool)


def _text(data: bytes) -> str | bytes:
    """Return the text of a cell; the bytes of one that is damaged."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data


def _states_no_interrupt(record: LogRecord) -> bool:
    """Return whether a record of the pool states no Ctrl-C, which is raised, too."""
    return not (record.exc_info and isinstance(record.exc_info[1], KeyboardInterrupt))


def _begin(connection: sa.Connection) -> None:
    if connection.dialect.name == "sqlite":
        if connection.get_execution_options().get("autocommit", False):
            return
        writes = connection.get_execution_options().get("writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _reason(error: DBAPIError) -> str:
    """Return the reason of a failure on one line."""
    original: Any = error.orig
    name = getattr(original, "sqlite_errorname", "")
    for prefix, known in _SQLITE_REASONS.items():
        if name.startswith(prefix):
            return known
    message = getattr(getattr(original, "diag", None), "message_primary", None)
    lines = str(message or original).splitlines()
    return lines[0].strip() if lines else type(original).__name__
