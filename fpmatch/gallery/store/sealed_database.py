"""The database of a gallery whose templates may be encrypted, and the keys given for it."""

from __future__ import annotations

import secrets
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa

from fpmatch.errors import EncryptionError
from fpmatch.gallery.encryption.keys import KeyRing, load_keys
from fpmatch.gallery.encryption.records import is_sealed
from fpmatch.gallery.store.database import DamagedRowError, Database, mark_overwritten
from fpmatch.gallery.store.digests import check_row, row_digest
from fpmatch.gallery.store.sealing import ENCRYPTED_VERSION, create_sealing, read_sealing
from fpmatch.gallery.store.tables import (
    ENTRY,
    GALLERY,
    VERSION,
    WHOLE,
    create_tables,
)

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Sequence

    from fpmatch.gallery.store.sealing import Sealing


class SealedDatabase(Database):
    """A `Database` whose rows are opened with `key`: keys, or their source.

    `damaged` has the reason of each row that was skipped as damaged, by its number.
    """

    def __init__(
        self,
        where: str | os.PathLike[str],
        *,
        create: bool = False,
        key: KeyRing | str | None = None,
        patience: float | None = None,
    ) -> None:
        super().__init__(where, create=create, patience=patience)
        self.key = key
        self._sealing: Sealing | None = None
        self.damaged: dict[int, str] = {}

    def sealing(self, connection: sa.Connection | None = None) -> Sealing | None:
        """Return how this gallery is encrypted now; None if it is not."""
        if connection is None:
            with self.reading() as own:
                return self.sealing(own)
        with self.naming_keys():
            self._sealing = read_sealing(connection, self.key)
        return self._sealing

    def current_key(self) -> str:
        """Return the id of the current one of the keys that were given.

        Raises EncryptionError if none was, or they cannot be read.
        """
        return as_keys(self.key).current.id

    def check_keys(self) -> None:
        """Raise GalleryError (code "missing key") unless all keys in use were given."""
        sealing = self.sealing()
        if sealing is not None:
            with self.naming_keys():
                sealing.check_keys()

    @property
    def encrypted(self) -> bool:
        """Whether this gallery was encrypted when that was read last."""
        return self._sealing is not None

    def sealed(
        self, connection: sa.Connection, rows: Sequence[dict[str, Any]]
    ) -> list[dict[str, Any]]:
        """Return the columns of new entries as they are stored."""
        sealing = self.sealing(connection)
        with self.naming_keys():
            stored = [row if sealing is None else sealing.seal_row(row) for row in rows]
        return [row | {"digest": row_digest(row)} for row in stored]

    def opened(self, row: Any) -> Any:
        """Return a row of all columns with the template as it was packed.

        Raises DamagedRowError if it is not what was stored; GalleryError if its key is missing.
        """
        check_row(row)
        known = self._sealing
        if known is None and not (isinstance(row.template, bytes) and is_sealed(row.template)):
            return row
        try:
            return self._unsealed(known, row)
        except DamagedRowError:
            with self.reading() as connection:  # its keys may have been changed meanwhile
                changed = self.sealing(connection) != known
                again = connection.execute(WHOLE.where(ENTRY.c.id == row.id)).first()
            if again is None or not changed:
                raise
        return self.opened(again)

    def _unsealed(self, sealing: Sealing | None, row: Any) -> Any:
        if sealing is None:
            raise DamagedRowError(row.id, "it is encrypted, in a gallery that is not")
        with self.naming_keys():
            return sealing.unseal_row(row)

    @contextmanager
    def naming_keys(self) -> Iterator[None]:
        """Turn an error about a missing key into one that names this gallery."""
        try:
            yield
        except EncryptionError as error:
            if error.code not in {"missing key", "damaged"}:
                raise
            raise self.error(str(error), error.code) from error


def as_keys(given: KeyRing | str | None) -> KeyRing:
    """Return the keys that were given, read from their source where that was given."""
    return given if isinstance(given, KeyRing) else load_keys(given)


def check_or_create(gallery: SealedDatabase, *, create: bool, encrypt: bool) -> None:
    """Check that there is a gallery of a known version, or make an empty one.

    One that is made to `encrypt` is encrypted with the current key; another must be encrypted.
    """
    with gallery.reading() as connection:
        tables = set(sa.inspect(connection).get_table_names())
    if GALLERY.name not in tables:
        if tables and gallery.file is not None:
            raise gallery.error("not a gallery but a database of something else", "no gallery")
        if not create:
            raise gallery.error("holds no gallery; `fpmatch enrol` makes one", "missing")
        with gallery.creating() as connection:
            if not sa.inspect(connection).has_table(GALLERY.name):  # made meanwhile by another
                create_tables(connection, secrets.token_hex(16))
                mark_overwritten(connection)
                if encrypt:
                    create_sealing(connection, (gallery.current_key(),))
                    connection.execute(GALLERY.update().values(version=ENCRYPTED_VERSION))
    with gallery.reading() as connection:
        version = connection.scalar(sa.select(GALLERY.c.version))
    if version is None:
        raise gallery.error("damaged: its version is missing", "damaged")
    if version not in {VERSION, ENCRYPTED_VERSION}:
        known = f"this fpmatch reads versions {VERSION} and {ENCRYPTED_VERSION}"
        raise gallery.error(f"a gallery of version {version}; {known}", "version")
    if encrypt and version == VERSION:
        why = "is not encrypted; `fpmatch gallery rewrite --encrypt` encrypts it"
        raise gallery.error(why, "not encrypted")
