r"""Large files sealed in blocks, each with its place: none can be changed, moved or cut off.

A file is, with a random salt of its own::

    8 bytes "\x89FPB\r\n\x1a" and the version, 1; 8 bytes key id; 16 bytes salt;
    blocks of 262,144 bytes (the last may have fewer), each followed by a tag of 16 bytes

The key of AES-256-GCM is derived from the key by HKDF-SHA256, with the purpose and the salt, for
this file alone. The nonce of a block is its number, 8 bytes little-endian, then a byte that is 1 in
the last block and 0 in the others. The associated data are the first 32 bytes of the file, the
purpose, and what the file is bound to.
"""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, BinaryIO, Final

from fpmatch.errors import EncryptionError
from fpmatch.gallery.encryption.records import NONCE_BYTES, TAG_BYTES, associated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from typing_extensions import Buffer

    from fpmatch.gallery.encryption.keys import Key, KeyRing

MAGIC: Final = b"\x89FPB\r\n\x1a\x01"
SALT_BYTES: Final = 16
HEAD_BYTES: Final = len(MAGIC) + 8 + SALT_BYTES
BLOCK_BYTES: Final = 2**18  # fits into a core's cache
_CUT_OFF: Final = "damaged: cut off"


class _Blocks:
    """Encrypt and decrypt the blocks of one file, by their numbers."""

    def __init__(self, key: Key, head: bytes, purpose: bytes, bound: Iterable[bytes]) -> None:
        from cryptography.hazmat.primitives.ciphers import Cipher, algorithms, modes  # noqa: PLC0415

        self._cipher, self._mode = Cipher, modes.GCM
        self._algorithm = algorithms.AES(key.derive(purpose, head[-SALT_BYTES:]))
        self._about = associated(head, purpose, *bound)

    def seal(self, number: int, block: bytes | bytearray, *, last: bool) -> bytes:
        """Return a block as it is stored, with its tag."""
        mode = self._mode(_nonce(number, last=last))
        encryptor = self._cipher(self._algorithm, mode).encryptor()
        encryptor.authenticate_additional_data(self._about)
        stored: bytes = encryptor.update(block)
        encryptor.finalize()
        tag: bytes = encryptor.tag
        return stored + tag

    def unseal(self, number: int, sealed: memoryview, into: memoryview, *, last: bool) -> None:
        """Write the content of a stored block to memory; raise EncryptionError if it differs."""
        from cryptography.exceptions import InvalidTag  # noqa: PLC0415

        mode = self._mode(_nonce(number, last=last), bytes(sealed[-TAG_BYTES:]))
        decryptor = self._cipher(self._algorithm, mode).decryptor()
        decryptor.authenticate_additional_data(self._about)
        decryptor.update_into(sealed[:-TAG_BYTES], into)
        try:
            decryptor.finalize()
        except InvalidTag:
            why = "damaged, or not what it was sealed as (its authentication failed)"
            raise EncryptionError(why, code="damaged") from None


class BlockWriter:
    """A stream that seals what is written to it; see `sealed_blocks`."""

    def __init__(self, stream: BinaryIO, key: Key, purpose: bytes, bound: Iterable[bytes]) -> None:
        head = MAGIC + bytes.fromhex(key.id) + os.urandom(SALT_BYTES)
        self._stream, self._waiting, self._count = stream, bytearray(), 0
        self._blocks = _Blocks(key, head, purpose, bound)
        stream.write(head)

    def write(self, data: Buffer) -> int:
        """Take bytes; whole blocks are written."""
        view = memoryview(data)
        view = view.cast("B") if view.nbytes else memoryview(b"")
        for k in range(0, len(view), BLOCK_BYTES):
            self._waiting += view[k : k + BLOCK_BYTES]
            if len(self._waiting) > BLOCK_BYTES:  # the last block is written by `end`
                self._put(self._waiting[:BLOCK_BYTES], last=False)
                del self._waiting[:BLOCK_BYTES]
        return len(view)

    def end(self) -> None:
        """Write the last block."""
        self._put(self._waiting, last=True)

    def _put(self, block: bytearray, *, last: bool) -> None:
        self._stream.write(self._blocks.seal(self._count, block, last=last))
        self._count += 1


@contextmanager
def sealed_blocks(
    stream: BinaryIO, key: Key, *, purpose: bytes, bound: Iterable[bytes] = ()
) -> Iterator[BlockWriter]:
    """Yield a stream whose content is sealed in blocks; the file is whole once the block ends.

    Examples
    --------
    >>> import io
    >>> from fpmatch.gallery.encryption.keys import KeyRing, new_key
    >>> key, file = new_key(), io.BytesIO()
    >>> with sealed_blocks(file, key, purpose=b"example") as stream:
    ...     _ = stream.write(b"prints")
    >>> bytes(unseal_blocks(KeyRing([key]), file, purpose=b"example"))
    b'prints'
    """
    writer = BlockWriter(stream, key, purpose, bound)
    yield writer
    writer.end()


def unseal_blocks(
    keys: KeyRing,
    stream: BinaryIO,
    *,
    purpose: bytes,
    bound: Iterable[bytes] = (),
    allocate: Callable[[int], Buffer] = bytearray,
) -> memoryview:
    """Return the content of a whole file, in memory from `allocate`, which takes its bytes.

    Raises EncryptionError: code "damaged" if a bit of it was changed, or it was bound to something
    else, "missing key" if its key is not among `keys`, "version" if it is of another version.
    """
    size = stream.seek(0, os.SEEK_END)
    stream.seek(0)
    head = stream.read(HEAD_BYTES)
    key = keys.find(_key_id(head, size))
    blocks = _Blocks(key, head, purpose, bound)
    whole = BLOCK_BYTES + TAG_BYTES
    count = -(-(size - HEAD_BYTES) // whole)
    length = size - HEAD_BYTES - count * TAG_BYTES
    if length < (count - 1) * BLOCK_BYTES:
        raise EncryptionError(_CUT_OFF, code="damaged")
    content = memoryview(allocate(length)).cast("B") if length else memoryview(bytearray())
    buffer = memoryview(bytearray(whole))
    source: Any = stream
    for number in range(count):
        start = number * BLOCK_BYTES
        sealed = buffer[: min(whole, length - start + TAG_BYTES)]
        if source.readinto(sealed) != len(sealed):
            raise EncryptionError(_CUT_OFF, code="damaged")
        into = content[start : start + len(sealed) - TAG_BYTES]
        blocks.unseal(number, sealed, into, last=number == count - 1)
    return content


def _key_id(head: bytes, size: int) -> str:
    """Return the id of the key in the first bytes of a file of some size."""
    if head[: len(MAGIC) - 1] != MAGIC[:-1] or size < HEAD_BYTES + TAG_BYTES:
        raise EncryptionError("not an encrypted file, or cut off", code="damaged")
    if head[: len(MAGIC)] != MAGIC:
        why = f"encrypted file of version {head[7]}; this fpmatch reads version {MAGIC[-1]}"
        raise EncryptionError(why, code="version")
    return head[len(MAGIC) : -SALT_BYTES].hex()


def _nonce(number: int, *, last: bool) -> bytes:
    return (number.to_bytes(8, "little") + bytes([last])).ljust(NONCE_BYTES, b"\0")
