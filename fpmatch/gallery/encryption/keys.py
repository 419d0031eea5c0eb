"""Keys of encrypted data in private files: read, make and add keys.

A text of keys has one key a line, its id and its 32 bytes in base64; the first is the current one,
with which new data are sealed::

    # fpmatch keys
    3f2a9c01d4e5b678 1Xq0...=
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import os
import secrets
import stat
from pathlib import Path
from typing import TYPE_CHECKING, Final, NoReturn

from fpmatch.base.output import atomic_write
from fpmatch.errors import EncryptionError, OutputError, without_path

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cryptography.hazmat.primitives.ciphers.aead import AESGCM

KEY_VARIABLE: Final = "FPMATCH_KEY"
"""The environment variable with the source of the keys, where a command or call names none."""

KEY_BYTES: Final = 32
ID_DIGITS: Final = 16  # of a key id, hexadecimal
SCHEME: Final = "file:"
SOURCE: Final = f"{SCHEME}PATH"
_LARGEST_TEXT: Final = 2**16  # characters: some hundred keys
_OTHERS: Final = stat.S_IRWXG | stat.S_IRWXO
_HEAD: Final = "# keys of fpmatch, the current one first; without them the data are lost\n"


class Key:
    """A secret key and its id, which is computed from it; the secret is never shown.

    A key cannot be pickled: programs send each other the source of their keys.

    Examples
    --------
    >>> Key(bytes(32))
    Key('4290bd01905d96eb')
    """

    __slots__ = ("_ciphers", "_secret", "id")

    def __init__(self, secret: bytes) -> None:
        if len(secret) != KEY_BYTES:
            raise EncryptionError(f"a key has {KEY_BYTES} bytes, not {len(secret)}", code="key")
        self._secret = secret
        self._ciphers: dict[tuple[bytes, bytes], AESGCM] = {}
        self.id = hashlib.sha256(b"fpmatch key id\0" + secret).hexdigest()[:ID_DIGITS]

    def __repr__(self) -> str:
        return f"Key({self.id!r})"

    def __reduce__(self) -> NoReturn:
        raise TypeError("a key is not pickled")

    def as_line(self) -> str:
        """Return the line of a text of keys, which contains the secret."""
        return f"{self.id} {base64.b64encode(self._secret).decode()}"

    def cipher(self, purpose: bytes, salt: bytes) -> AESGCM:
        """Return the cipher of the key that is derived for a purpose and a salt by HKDF-SHA256.

        It is kept for the next call.
        """
        if (purpose, salt) not in self._ciphers:
            try:
                from cryptography.hazmat.primitives.ciphers.aead import AESGCM  # noqa: PLC0415
                from cryptography.hazmat.primitives.hashes import SHA256  # noqa: PLC0415
                from cryptography.hazmat.primitives.kdf.hkdf import HKDF  # noqa: PLC0415
            except ImportError as error:
                why = "encryption needs cryptography: pip install 'fpmatch[encryption]'"
                raise EncryptionError(why, code="not installed") from error
            derivation = HKDF(SHA256(), KEY_BYTES, salt, b"fpmatch " + purpose)
            self._ciphers[purpose, salt] = AESGCM(derivation.derive(self._secret))
        return self._ciphers[purpose, salt]


class KeyRing:
    """Some keys, the first of them the current one, and the source they were read from.

    A key that is unknown is looked for in the source once more: it may have been added meanwhile.
    What is pickled is the source, not the keys.

    Examples
    --------
    >>> from fpmatch.gallery.encryption.keys import Key, KeyRing
    >>> KeyRing([Key(bytes(32))])
    KeyRing('4290bd01905d96eb')
    """

    __slots__ = ("_keys", "source")

    def __init__(self, keys: Iterable[Key], source: str = "") -> None:
        self._keys = {key.id: key for key in keys}
        self.source = source
        if not self._keys:
            raise EncryptionError(f"{source or 'a key ring'}: no key in it", code="key")

    def __repr__(self) -> str:
        return f"KeyRing({', '.join(map(repr, self.ids))})"

    def __reduce__(self) -> tuple[object, ...]:
        if not self.source:
            raise TypeError("keys without a source are not pickled")
        return load_keys, (self.source,)

    @property
    def current(self) -> Key:
        """The key for new data."""
        return next(iter(self._keys.values()))

    @property
    def ids(self) -> tuple[str, ...]:
        """The ids of the keys, that of the current one first."""
        return tuple(self._keys)

    def find(self, key_id: str) -> Key:
        """Return the key of an id; EncryptionError (code "missing key") if there is none."""
        if key_id not in self._keys and self.source:
            self._keys = load_keys(self.source)._keys
        if key_id not in self._keys:
            raise _missing_key(key_id, f"; the keys given are {', '.join(self.ids)}")
        return self._keys[key_id]


def _missing_key(key_id: str, given: str = "") -> EncryptionError:
    """Return the error about data whose key was not given."""
    remedy = f"give it with {KEY_VARIABLE}, or --key where the command has it"
    return EncryptionError(f"encrypted with key {key_id}; {remedy}{given}", code="missing key")


def given_source() -> str:
    """Return the source that the environment names, "" for none."""
    return os.environ.get(KEY_VARIABLE, "")


def load_keys(source: KeyRing | str | None = None, key_id: str = "") -> KeyRing:
    """Return the keys of a source.

    Parameters
    ----------
    source : KeyRing or str, optional
        ``file:PATH``, which no other user may read (default: that in the environment variable
        ``FPMATCH_KEY``); keys are returned as they are.
    key_id : str
        The id of the key that is needed, which the error names where there is no source.

    Raises
    ------
    EncryptionError
        If there is no source, it cannot be read, others may read it, or it contains no keys.

    Examples
    --------
    >>> import tempfile
    >>> from fpmatch.gallery.encryption.keys import load_keys, make_keys
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = make_keys(f"file:{folder}/keys.txt")
    ...     load_keys(f"file:{folder}/keys.txt").ids == made.ids
    True
    """
    if isinstance(source, KeyRing):
        return source
    chosen = given_source() if source is None else source
    if not chosen and key_id:
        raise _missing_key(key_id)
    if not chosen:
        why = f"no key was given; {KEY_VARIABLE} names one: {SOURCE}"
        raise EncryptionError(why, code="missing key")
    return KeyRing(parse_keys(_read_file(path_of(chosen)), chosen), chosen)


def make_keys(source: str) -> KeyRing:
    """Make a new key and write it to ``file:PATH``, where nothing is yet.

    Raises EncryptionError if there is something, or it cannot be written.
    """
    if path_of(source).exists():
        why = "is there already; --add puts a new key into it, as the current one"
        raise EncryptionError(why, path=source, code="exists")
    return _write(source, [])


def add_key(source: str) -> KeyRing:
    """Put a new key, as the current one, before the keys of a source; return all."""
    old = load_keys(source)
    return _write(source, map(old.find, old.ids))


def path_of(source: str) -> Path:
    """Return the file of a source of keys; EncryptionError if it is none."""
    path = source.removeprefix(SCHEME)
    if path in {source, ""}:
        # the text is not repeated: it may be a key
        raise EncryptionError(f"not a source of keys: expected {SOURCE}", code="source")
    return Path(path)


def parse_keys(text: str, source: str) -> list[Key]:
    """Return the keys of a text; errors name `source` and line, and repeat nothing of it."""
    keys = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            key = Key(base64.b64decode(words[-1], validate=True))
        except (binascii.Error, ValueError, EncryptionError):
            key = None
        if key is None or len(words) > 2:
            why = f"line {number}: not a key: expected its id and {KEY_BYTES} bytes in base64"
            raise EncryptionError(why, path=source, code="key")
        if len(words) == 2 and words[0] != key.id:
            why = f"line {number}: the id is not that of the key, {key.id}: one is mistyped"
            raise EncryptionError(why, path=source, code="key")
        keys.append(key)
    return keys


def _read_file(path: Path) -> str:
    source = f"file:{path}"
    try:
        if path.exists() and not path.is_file():  # to open a pipe would wait for its other end
            raise EncryptionError("not a regular file", path=source, code="source")
        with path.open("rb") as stream:
            status = os.fstat(stream.fileno())
            if os.name == "posix" and status.st_mode & _OTHERS:
                why = f"other users may read it; first: chmod 600 {path}"
                raise EncryptionError(why, path=source, code="not private")
            return stream.read(_LARGEST_TEXT).decode()
    except UnicodeDecodeError:
        raise EncryptionError("not a text of keys", path=source, code="key") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise EncryptionError(why.lower(), path=source, code="missing source") from error


def _write(source: str, old: Iterable[Key]) -> KeyRing:
    """Write a new key and old ones to a file that no other user can read; it appears whole."""
    path = path_of(source)
    keys = [Key(secrets.token_bytes(KEY_BYTES)), *old]
    try:
        with atomic_write(path) as stream:
            stream.write((_HEAD + "".join(f"{key.as_line()}\n" for key in keys)).encode())
            stream.flush()
            os.fsync(stream.fileno())
    except OutputError as error:
        why = without_path(str(error), path)
        raise EncryptionError(why, path=source, code="output") from error
    return KeyRing(keys, source)
