"""Encryption of a gallery: the key in use, and how its entries and its index are sealed.

An encrypted gallery has a table with its random id and the id of its key. A template is a sealed
record that is bound to the gallery and to all columns of its row but the number.
"""

from __future__ import annotations

import secrets
import struct
from dataclasses import dataclass
from functools import cached_property
from string import hexdigits
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from fpmatch.errors import EncryptionError, FpmatchError
from fpmatch.gallery.encryption.keys import ID_DIGITS, load_keys
from fpmatch.gallery.encryption.records import key_id_of, seal, unseal
from fpmatch.gallery.store.tables import (
    ENCRYPTED_VERSION,
    ENCRYPTION,
    GALLERY,
    DamagedRowError,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.gallery.encryption.keys import Key, KeyRing

_ID_BYTES: Final = 16
_ENTRY: Final = b"gallery entry"
_INDEX: Final = b"index"
_VERSION: Final = sa.select(GALLERY.c.version)
_BOUND: Final = ("subject", "finger", "impression", "source", "content", "dpi", "minutiae")


@dataclass(frozen=True)
class Sealing:
    """Seal and unseal the templates and the index of a gallery.

    `gallery` is its id and `key_id` the id of its key; `given` are the keys that were given, or
    their source.
    """

    gallery: bytes
    key_id: str
    given: KeyRing | str | None

    @cached_property
    def ring(self) -> KeyRing:
        """The keys that were given; EncryptionError if there are none."""
        return load_keys(self.given, self.key_id)

    @property
    def key(self) -> Key:
        """The key in use; EncryptionError (code "missing key") if it was not given."""
        return self.ring.find(self.key_id)

    def seal_row(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the columns of an entry with the template as it is stored."""
        bound = [*_as_bytes(row)]
        sealed = seal(self.key, row["template"], purpose=_ENTRY, salt=self.gallery, bound=bound)
        return row | {"template": sealed}

    def unseal_row(self, row: Any) -> Any:
        """Return a row of all columns with the template as it was packed.

        Raises DamagedRowError if row or template were changed, or belong to another entry or
        gallery; EncryptionError (code "missing key") if its key was not given.
        """
        columns = row._asdict()
        try:
            key_id = key_id_of(row.template)
            if key_id != self.key_id:
                why = f"encrypted with key {key_id}, which the gallery does not use"
                raise DamagedRowError(row.id, why)
            bound = [*_as_bytes(columns)]
            packed = unseal(self.ring, row.template, purpose=_ENTRY, salt=self.gallery, bound=bound)
        except EncryptionError as error:
            if error.code in {"damaged", "version"}:
                raise DamagedRowError(row.id, str(error)) from None
            raise
        return SimpleNamespace(**columns | {"template": packed})

    def seal_file(self, content: bytes) -> bytes:
        """Return the content of a file of an index as it is stored."""
        return seal(self.key, content, purpose=_INDEX, salt=self.gallery)

    def unseal_file(self, stored: bytes) -> bytes:
        """Return the content of a file of an index.

        Raises FpmatchError: code "damaged", or "other" if it is sealed with another key.
        """
        try:
            return unseal(self.ring, stored, purpose=_INDEX, salt=self.gallery)
        except EncryptionError as error:
            code = "damaged" if error.code == "damaged" else "other"
            raise FpmatchError(str(error), code=code) from error


def read_sealing(connection: sa.Connection, given: KeyRing | str | None) -> Sealing | None:
    """Return how a gallery is sealed; None if it is not encrypted.

    Raises EncryptionError (code "damaged") if the key in use is not recorded.
    """
    if connection.scalar(_VERSION) != ENCRYPTED_VERSION:
        return None
    row = connection.execute(sa.select(ENCRYPTION)).first()
    key_id = "" if row is None else str(row.keys)
    if row is None or len(key_id) != ID_DIGITS or set(key_id) - set(hexdigits):
        raise EncryptionError("damaged: the key in use is missing", code="damaged")
    return Sealing(bytes(row.gallery), key_id, given)


def set_key(connection: sa.Connection, key_id: str) -> None:
    """Record that a gallery is encrypted with a key; it gets an id where it has none."""
    ENCRYPTION.create(connection, checkfirst=True)
    if not connection.execute(ENCRYPTION.update().values(keys=key_id)).rowcount:
        new_id = secrets.token_bytes(_ID_BYTES)
        connection.execute(ENCRYPTION.insert().values(id=1, gallery=new_id, keys=key_id))
    connection.execute(GALLERY.update().values(version=ENCRYPTED_VERSION))


def _as_bytes(row: dict[str, Any]) -> Iterator[bytes]:
    """Yield what a template is bound to: the columns of its row, each by its type."""
    for value in map(row.__getitem__, _BOUND):
        match value:
            case str():
                yield b"s" + value.encode("utf-8", "surrogatepass")
            case bytes():
                yield b"b" + value
            case number:
                yield b"n" + struct.pack("<d", number)
