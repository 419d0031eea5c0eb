"""Blocks of a large file under authenticated encryption, for a container that numbers them."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Final

from fpmatch.encryption.records import NONCE_BYTES, TAG_BYTES

if TYPE_CHECKING:
    from fpmatch.encryption.keys import Key


class SealedBlocks:
    """Seal blocks with AES-256-GCM, each with a random nonce, which is part of its tag.

    It is a protection of `fpmatch.array_file`, by the name of the key's id. The key of the blocks
    is derived from `key` for a purpose and a salt.

    Examples
    --------
    >>> from fpmatch.encryption.keys import new_key
    >>> blocks = SealedBlocks(new_key(), b"example", b"gallery 1")
    >>> stored, tag = blocks.seal(memoryview(b"prints"), b"block 1")
    >>> content = bytearray(6)
    >>> blocks.open(stored, tag, b"block 1", memoryview(content))
    >>> content
    bytearray(b'prints')
    """

    tag_bytes: Final = NONCE_BYTES + TAG_BYTES
    conceals: Final = True

    def __init__(self, key: Key, purpose: bytes, salt: bytes) -> None:
        from cryptography.hazmat.primitives.ciphers import algorithms  # noqa: PLC0415  (an extra)

        self.name = key.id
        self._algorithm = algorithms.AES(key.derive(purpose, salt))

    def __repr__(self) -> str:
        return f"SealedBlocks({self.name!r})"

    def seal(self, block: memoryview, associated: bytes) -> tuple[memoryview, bytes]:
        """Return a block as it is stored, and its tag, which depends on `associated` too."""
        from cryptography.hazmat.primitives.ciphers import Cipher, modes  # noqa: PLC0415

        nonce = os.urandom(NONCE_BYTES)
        encryptor = Cipher(self._algorithm, modes.GCM(nonce)).encryptor()
        encryptor.authenticate_additional_data(associated)
        stored = memoryview(encryptor.update(block))
        encryptor.finalize()
        return stored, nonce + encryptor.tag

    def open(self, stored: memoryview, tag: bytes, associated: bytes, into: memoryview) -> None:
        """Write a stored block to `into`; ValueError if it, its tag or `associated` was altered."""
        from cryptography.exceptions import InvalidTag  # noqa: PLC0415
        from cryptography.hazmat.primitives.ciphers import Cipher, modes  # noqa: PLC0415

        mode = modes.GCM(tag[:NONCE_BYTES], tag[NONCE_BYTES:])
        decryptor = Cipher(self._algorithm, mode).decryptor()
        decryptor.authenticate_additional_data(associated)
        decryptor.update_into(stored, into)
        try:
            decryptor.finalize()
        except InvalidTag:
            raise ValueError("a block has been altered") from None
