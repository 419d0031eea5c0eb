"""Make, add to and remove from the texts of keys in files and in the system keyring."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.base.output import atomic_write
from fpmatch.errors import EncryptionError, OutputError, without_path
from fpmatch.gallery.encryption.keys import (
    Key,
    KeyRing,
    load_keys,
    new_key,
    read_keyring,
    split_source,
    write_keyring,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

_HEAD: Final = "# keys of fpmatch, the current one first; without them the data are lost\n"


def make_keys(source: str) -> KeyRing:
    """Make a new key and write it to ``file:PATH`` or ``keyring:NAME``, where nothing is yet.

    Raises EncryptionError if there is something, or it cannot be written.
    """
    kind, name = _written(source)
    there = Path(name).exists() if kind == "file" else bool(read_keyring(name))
    if there:
        why = "is there already; --add puts a new key into it, as the current one"
        raise EncryptionError(why, path=source, code="exists")
    return _write(source, [new_key()])


def add_key(source: str) -> KeyRing:
    """Put a new key, as the current one, before those of a source; return all."""
    _written(source)
    old = load_keys(source)
    return _write(source, [new_key(), *(old.find(key_id) for key_id in old.ids)])


def remove_key(source: str, key_id: str) -> KeyRing:
    """Remove a key that is not the current one from a source; return the others.

    Raises EncryptionError if there is no such key, or it is the current one.
    """
    _written(source)
    old = load_keys(source)
    if key_id not in old.ids:
        raise EncryptionError(f"no key {key_id} in it", path=source, code="missing key")
    if key_id == old.current.id:
        why = f"key {key_id} is the current one, which is not removed"
        raise EncryptionError(why, path=source, code="key")
    return _write(source, [old.find(other) for other in old.ids if other != key_id])


def _written(source: str) -> tuple[str, str]:
    kind, name = split_source(source)
    if kind == "env":
        why = "a variable of the environment cannot be changed; give file:PATH or keyring:NAME"
        raise EncryptionError(why, path=source, code="source")
    return kind, name


def _write(source: str, keys: Iterable[Key]) -> KeyRing:
    kept = list(keys)
    text = _HEAD + "".join(f"{key.as_line()}\n" for key in kept)
    kind, name = split_source(source)
    if kind == "file":
        _write_private(Path(name), text.encode(), source)
    else:
        write_keyring(name, text)
    return KeyRing(kept, source)


def _write_private(path: Path, content: bytes, source: str) -> None:
    """Write a file that no other user could read at any moment; it appears whole."""
    try:
        with atomic_write(path) as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
    except OutputError as error:
        why = without_path(str(error), path)
        raise EncryptionError(why, path=source, code="output") from error
