"""Write files whole or not at all: into another file first, which is then moved into place.

Files and folders are private: only the user who runs fpmatch may read them, whatever the umask,
since they contain biometric data, names, or results about persons. `public` files contain none:
their rights follow the umask. On Windows, files have the rights of the folder.
"""

from __future__ import annotations

import os
import secrets
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from fpmatch.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import BinaryIO

PRIVATE_FILE = 0o600


@contextmanager
def _unfinished_beside(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield the path of an unfinished file, and remove it; an OSError becomes an OutputError."""
    target = Path(path)
    unfinished = target.parent / f".{secrets.token_hex(8)}.part"
    try:
        if target.is_dir():  # an OSError for a name that is too long
            raise OutputError(f"{path}: cannot be written: it is a folder")
        yield unfinished
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {reason(error)}") from error
    finally:
        if unfinished.exists():
            unfinished.unlink()


@contextmanager
def atomic_write(path: str | os.PathLike[str], *, public: bool = False) -> Iterator[BinaryIO]:
    """Yield an unfinished file beside `path`, which replaces it once the block has ended well."""
    with _unfinished_beside(path) as unfinished:
        with open(unfinished, "xb", opener=None if public else open_private) as stream:
            yield stream
        unfinished.replace(path)


def atomic_write_bytes(
    path: str | os.PathLike[str], content: bytes, *, public: bool = False
) -> None:
    """Write `content` to a file as `atomic_write` does."""
    with atomic_write(path, public=public) as stream:
        stream.write(content)


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise OutputError if a file could not be written, before hours of work go into it."""
    with _unfinished_beside(path) as trial:
        trial.touch(exist_ok=False)


def open_private(path: str, flags: int) -> int:
    """Open a file that only its owner may read: an opener of `open`."""
    handle = os.open(path, flags, PRIVATE_FILE)
    Path(path).chmod(PRIVATE_FILE)  # where the umask withholds rights from the owner, too
    return handle


def reason(error: OSError) -> str:
    """Return the system's message about a failure, in lower case."""
    return (error.strerror or str(error)).lower()
