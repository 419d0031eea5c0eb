r"""Sealed records: a template, or any other bytes, that only the holder of a key reads or writes.

A record is, with a random nonce of its own::

    8 bytes "\x89FPS\r\n\x1a" and the version, 1; 8 bytes key id; 12 bytes nonce;
    the ciphertext; 16 bytes tag

The key of AES-256-GCM is derived from the key by HKDF-SHA256, with the purpose and a salt (in
galleries their id). With random nonces of 96 bits, 2^32 records a derived key leave a chance of
2^-33 that two have the same nonce. The associated data, which the tag protects too, are the bytes
before the nonce, purpose and salt, and what the record is bound to, such as the label of an entry.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Final

from fpmatch.errors import EncryptionError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fpmatch.gallery.encryption.keys import Key, KeyRing

MAGIC: Final = b"\x89FPS\r\n\x1a\x01"
HEAD_BYTES: Final = 16  # of magic and key id, the same for all records of a key
NONCE_BYTES: Final = 12
TAG_BYTES: Final = 16
OVERHEAD: Final = HEAD_BYTES + NONCE_BYTES + TAG_BYTES
_FAMILY: Final = len(MAGIC) - 1  # bytes of the magic before its version


def is_sealed(data: bytes) -> bool:
    """Return whether bytes begin as a sealed record, of any version."""
    return data[:_FAMILY] == MAGIC[:_FAMILY]


def key_id_of(data: bytes) -> str:
    """Return the id of the key of a sealed record; EncryptionError if it is none."""
    if not is_sealed(data) or len(data) < OVERHEAD:
        raise EncryptionError("not encrypted data, or cut off", code="damaged")
    if data[: len(MAGIC)] != MAGIC:
        why = f"encrypted data of version {data[_FAMILY]}; this fpmatch reads version {MAGIC[-1]}"
        raise EncryptionError(why, code="version")
    return data[len(MAGIC) : HEAD_BYTES].hex()


def seal(
    key: Key, data: bytes, *, purpose: bytes, salt: bytes = b"", bound: Iterable[bytes] = ()
) -> bytes:
    """Return `data` as a sealed record, bound to a purpose, a salt and further bytes.

    Examples
    --------
    >>> from fpmatch.gallery.encryption.keys import Key, KeyRing
    >>> key = Key(bytes(32))
    >>> record = seal(key, b"a template", purpose=b"example", bound=[b"ada"])
    >>> unseal(KeyRing([key]), record, purpose=b"example", bound=[b"ada"])
    b'a template'
    """
    head, nonce = MAGIC + bytes.fromhex(key.id), os.urandom(NONCE_BYTES)
    sealed = key.cipher(purpose, salt).encrypt(nonce, data, _bound(head, purpose, salt, *bound))
    return head + nonce + sealed


def unseal(
    keys: KeyRing, record: bytes, *, purpose: bytes, salt: bytes = b"", bound: Iterable[bytes] = ()
) -> bytes:
    """Return the content of a sealed record.

    Raises EncryptionError: code "damaged" if a bit of it was changed, or it was bound to something
    else, "missing key" if its key is not among `keys`, "version" if it is of another version.
    """
    from cryptography.exceptions import InvalidTag  # noqa: PLC0415  (an extra)

    cipher = keys.find(key_id_of(record)).cipher(purpose, salt)
    head, rest = record[:HEAD_BYTES], record[HEAD_BYTES:]
    nonce, sealed = rest[:NONCE_BYTES], rest[NONCE_BYTES:]
    try:
        return cipher.decrypt(nonce, sealed, _bound(head, purpose, salt, *bound))
    except InvalidTag:
        why = "damaged, or not what it was sealed as (its authentication failed)"
        raise EncryptionError(why, code="damaged") from None


def _bound(*parts: bytes) -> bytes:
    """Return parts, each after its length, so that no two lists give the same bytes."""
    return b"".join(len(part).to_bytes(4, "little") + part for part in parts)
