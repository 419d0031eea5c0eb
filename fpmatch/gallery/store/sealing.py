"""Encryption of a gallery: the keys in use, and how its entries and its index are sealed.

A gallery of version 4 has a table with its random id and the ids of the keys in use, the first
of which seals new entries. While a rotation is under way there are several; "plain" stands for
templates that are not encrypted. A template is a sealed record that is bound to the gallery and to
all columns of its row but the number.
"""

from __future__ import annotations

import secrets
import struct
from dataclasses import dataclass
from string import hexdigits
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from fpmatch.errors import EncryptionError, FpmatchError
from fpmatch.gallery.encryption.keys import ID_DIGITS, KeyRing, keys_for
from fpmatch.gallery.encryption.records import is_sealed, key_id_of, seal, unseal
from fpmatch.gallery.store.database import DamagedRowError
from fpmatch.gallery.store.tables import GALLERY, VERSION

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.gallery.encryption.keys import Key

ENCRYPTED_VERSION: Final = VERSION + 1
"""Version of an encrypted gallery; others have `fpmatch.gallery.store.tables.VERSION`."""

PLAIN: Final = "plain"
_ID_BYTES: Final = 16
_ENTRY: Final = b"gallery entry"
_INDEX: Final = b"index"
_BOUND: Final = ("subject", "finger", "impression", "source", "content", "dpi", "minutiae")

_metadata = sa.MetaData()

ENCRYPTION: Final = sa.Table(
    "fpmatch_encryption",
    _metadata,
    sa.Column("id", sa.Integer, sa.CheckConstraint("id = 1"), primary_key=True),
    sa.Column("gallery", sa.LargeBinary, nullable=False),
    sa.Column("keys", sa.Text, nullable=False),  # ids, separated by spaces
)


@dataclass(frozen=True, slots=True)
class Sealing:
    """Seal and unseal the templates and the index of a gallery.

    `gallery` is its id, `keys` are the ids of the keys in use, that of new entries first, and
    `given` are the keys that were given, or their source.
    """

    gallery: bytes
    keys: tuple[str, ...]
    given: KeyRing | str | None

    @property
    def encrypts(self) -> bool:
        """Whether new entries, and files, are encrypted."""
        return self.keys[0] != PLAIN

    def ring(self, key_id: str) -> KeyRing:
        """Return the keys that were given; EncryptionError if there are none."""
        if isinstance(self.given, KeyRing):
            return self.given
        return keys_for(key_id, self.given)

    def check_keys(self) -> None:
        """Raise EncryptionError (code "missing key") unless all keys in use were given."""
        for key_id in self.keys:
            if key_id != PLAIN:
                self.key(key_id)

    def key(self, key_id: str) -> Key:
        """Return a key that was given; EncryptionError (code "missing key") if it was not."""
        return self.ring(key_id).find(key_id)

    def seal_row(self, row: dict[str, Any], key_id: str | None = None) -> dict[str, Any]:
        """Return the columns of an entry with the template as it is stored.

        It is sealed with the key of an id (default: that of new entries).
        """
        chosen = self.keys[0] if key_id is None else key_id
        if chosen == PLAIN:
            return row
        bound = [*_as_bytes(row)]
        sealed = seal(
            self.key(chosen), row["template"], purpose=_ENTRY, salt=self.gallery, bound=bound
        )
        return row | {"template": sealed}

    def unseal_row(self, row: Any) -> Any:
        """Return a row of all columns with the template as it was packed.

        Raises DamagedRowError if row or template were changed, or belong to another entry or
        gallery; EncryptionError (code "missing key") if its key was not given.
        """
        columns = row._asdict()
        data = row.template
        if not isinstance(data, bytes):
            raise DamagedRowError(row.id, "it has no template")
        if not is_sealed(data) and PLAIN in self.keys:
            return row
        try:
            key_id = key_id_of(data)
            if key_id not in self.keys:
                why = f"encrypted with key {key_id}, which the gallery does not use"
                raise DamagedRowError(row.id, why)
            keys, bound = self.ring(key_id), [*_as_bytes(columns)]
            packed = unseal(keys, data, purpose=_ENTRY, salt=self.gallery, bound=bound)
        except EncryptionError as error:
            if error.code in {"damaged", "version"}:
                raise DamagedRowError(row.id, str(error)) from None
            raise
        return SimpleNamespace(**columns | {"template": packed})

    def seal_file(self, content: bytes) -> bytes:
        """Return the content of a file of an index as it is stored."""
        return seal(self.key(self.keys[0]), content, purpose=_INDEX, salt=self.gallery)

    def unseal_file(self, stored: bytes) -> bytes:
        """Return the content of a file of an index.

        Raises FpmatchError: code "damaged", or "other" if it is sealed with another key.
        """
        try:
            return unseal(self.ring(self.keys[0]), stored, purpose=_INDEX, salt=self.gallery)
        except EncryptionError as error:
            code = "damaged" if error.code == "damaged" else "other"
            raise FpmatchError(str(error), code=code) from error


def read_sealing(connection: sa.Connection, given: KeyRing | str | None) -> Sealing | None:
    """Return how a gallery is sealed; None if it is not encrypted.

    Raises EncryptionError (code "damaged") if the keys in use are not recorded.
    """
    if connection.scalar(sa.select(GALLERY.c.version)) != ENCRYPTED_VERSION:
        return None
    row = None
    if sa.inspect(connection).has_table(ENCRYPTION.name):
        row = connection.execute(sa.select(ENCRYPTION)).first()
    keys = str(row.keys).split() if row is not None else []
    if row is None or not isinstance(row.gallery, bytes) or not keys or not all(map(_is_id, keys)):
        raise EncryptionError("damaged: the keys in use are missing", code="damaged")
    return Sealing(row.gallery, tuple(keys), given)


def _is_id(text: str) -> bool:
    return text == PLAIN or (len(text) == ID_DIGITS and not set(text) - set(hexdigits))


def create_sealing(connection: sa.Connection, keys: tuple[str, ...]) -> None:
    """Record that a gallery is encrypted with keys; it gets an id."""
    _metadata.create_all(connection)
    connection.execute(ENCRYPTION.delete())
    new_id = secrets.token_bytes(_ID_BYTES)
    connection.execute(ENCRYPTION.insert().values(id=1, gallery=new_id, keys=" ".join(keys)))


def set_keys(connection: sa.Connection, keys: tuple[str, ...]) -> None:
    """Record which keys are in use; none of a gallery that is not encrypted any more."""
    if keys:
        connection.execute(ENCRYPTION.update().values(keys=" ".join(keys)))
    else:
        connection.execute(ENCRYPTION.delete())


def _as_bytes(row: dict[str, Any]) -> Iterator[bytes]:
    """Yield what a template is bound to: the columns of its row, each by its type."""
    for name in _BOUND:
        value = row[name]
        match value:
            case str():
                yield b"s" + value.encode("utf-8", "surrogatepass")
            case bytes():
                yield b"b" + value
            case int() | float():
                yield b"n" + struct.pack("<d", value)
            case _:
                yield b"?"
