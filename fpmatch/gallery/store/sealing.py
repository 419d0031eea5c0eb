"""Encryption of a gallery: the key in use, and how its entries and its index are sealed.

A gallery of version 4 has a table with its random id and the id of its key. A template is a sealed
record that is bound to the gallery and to all columns of its row but the number.
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
from fpmatch.gallery.store.tables import GALLERY, VERSION, DamagedRowError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fpmatch.gallery.encryption.keys import Key

ENCRYPTED_VERSION: Final = VERSION + 1
"""Version of an encrypted gallery; others have `fpmatch.gallery.store.tables.VERSION`."""

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
    sa.Column("keys", sa.Text, nullable=False),  # its id; of earlier versions perhaps several
)


@dataclass(frozen=True, slots=True)
class Sealing:
    """Seal and unseal the templates and the index of a gallery.

    `gallery` is its id and `key_id` the id of its key; `given` are the keys that were given, or
    their source. A rotation that an earlier version left unfinished may have left templates that
    are `mixed`: of other keys, or not encrypted.
    """

    gallery: bytes
    key_id: str
    given: KeyRing | str | None
    mixed: bool = False

    @property
    def ring(self) -> KeyRing:
        """The keys that were given; EncryptionError if there are none."""
        return self.given if isinstance(self.given, KeyRing) else keys_for(self.key_id, self.given)

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
        data = row.template
        if not isinstance(data, bytes):
            raise DamagedRowError(row.id, "it has no template")
        if self.mixed and not is_sealed(data):
            return row
        try:
            key_id = key_id_of(data)
            if key_id != self.key_id and not self.mixed:
                why = f"encrypted with key {key_id}, which the gallery does not use"
                raise DamagedRowError(row.id, why)
            columns = row._asdict()
            bound = [*_as_bytes(columns)]
            packed = unseal(self.ring, data, purpose=_ENTRY, salt=self.gallery, bound=bound)
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
    if connection.scalar(sa.select(GALLERY.c.version)) != ENCRYPTED_VERSION:
        return None
    row = None
    if sa.inspect(connection).has_table(ENCRYPTION.name):
        row = connection.execute(sa.select(ENCRYPTION)).first()
    recorded = str(row.keys).split() if row is not None else []
    ids = [word for word in recorded if len(word) == ID_DIGITS and not set(word) - set(hexdigits)]
    if row is None or not isinstance(row.gallery, bytes) or not ids:
        raise EncryptionError("damaged: the key in use is missing", code="damaged")
    return Sealing(row.gallery, ids[0], given, mixed=len(recorded) > 1)


def set_key(connection: sa.Connection, key_id: str) -> None:
    """Record that a gallery is encrypted with a key; it gets an id where it has none."""
    _metadata.create_all(connection)
    if not connection.execute(ENCRYPTION.update().values(keys=key_id)).rowcount:
        new_id = secrets.token_bytes(_ID_BYTES)
        connection.execute(ENCRYPTION.insert().values(id=1, gallery=new_id, keys=key_id))
    connection.execute(GALLERY.update().values(version=ENCRYPTED_VERSION))


def set_plain(connection: sa.Connection) -> None:
    """Record that a gallery is not encrypted any more."""
    connection.execute(ENCRYPTION.delete())
    connection.execute(GALLERY.update().values(version=VERSION))


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
