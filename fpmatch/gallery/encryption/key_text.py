"""Make, add to and remove from files of keys."""

from __future__ import annotations

import os
import secrets
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.base.output import atomic_write
from fpmatch.errors import EncryptionError, OutputError, without_path
from fpmatch.gallery.encryption.keys import KEY_BYTES, Key, KeyRing, load_keys, split_source

if TYPE_CHECKING:
    from collections.abc import Sequence

_HEAD: Final = "# keys of fpmatch, the current one first; without them the data are lost\n"


def make_keys(source: str) -> KeyRing:
    """Make a new key and write it to ``file:PATH``, where nothing is yet.

    Raises EncryptionError if there is something, or it cannot be written.
    """
    if _path_of(source).exists():
        why = "is there already; --add puts a new key into it, as the current one"
        raise EncryptionError(why, path=source, code="exists")
    return _write(source, [_new_key()])


def add_key(source: str) -> KeyRing:
    """Put a new key, as the current one, before those of a source; return all."""
    _path_of(source)
    old = load_keys(source)
    return _write(source, [_new_key(), *map(old.find, old.ids)])


def _new_key() -> Key:
    return Key(secrets.token_bytes(KEY_BYTES))


def _path_of(source: str) -> Path:
    """Return the file of a source; EncryptionError if it is the environment."""
    kind, name = split_source(source)
    if kind == "env":
        why = "a variable of the environment cannot be changed; give file:PATH"
        raise EncryptionError(why, path=source, code="source")
    return Path(name)


def _write(source: str, keys: Sequence[Key]) -> KeyRing:
    """Write a file that no other user could read at any moment; it appears whole."""
    path = _path_of(source)
    text = _HEAD + "".join(f"{key.as_line()}\n" for key in keys)
    try:
        with atomic_write(path) as stream:
            stream.write(text.encode())
            stream.flush()
            os.fsync(stream.fileno())
    except OutputError as error:
        why = without_path(str(error), path)
        raise EncryptionError(why, path=source, code="output") from error
    return KeyRing(keys, source)
