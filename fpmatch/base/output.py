"""Write files whole or not at all: into another file first, which is then moved into place.

Files and folders are private: only the user who runs fpmatch may read them, whatever the umask,
since they contain biometric data, names, or results about persons. `public` files contain none:
their rights follow the umask. On Windows, files have the rights of the folder.
"""

from __future__ import annotations

import os
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from fpmatch.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from typing import BinaryIO

PRIVATE_FILE = 0o600
PRIVATE_FOLDER = 0o700


@contextmanager
def _one_line(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turn an OSError into an OutputError that names `path`, whatever file it is about."""
    try:
        if Path(path).is_dir():  # an OSError for a name that is too long
            raise OutputError(f"{path}: cannot be written: it is a folder")
        yield
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {reason(error)}") from error


@contextmanager
def _unfinished_in(folder: Path) -> Iterator[Path]:
    """Yield the path of an unfinished file in a folder, and remove what is left of it."""
    unfinished = folder / f".{os.urandom(8).hex()}.part"
    try:
        yield unfinished
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


@contextmanager
def atomic_write(path: str | os.PathLike[str], *, public: bool = False) -> Iterator[BinaryIO]:
    """Yield an unfinished file beside `path`, which replaces it once the block has ended well.

    Folders that are missing are made; where the block fails, they are removed again.
    """
    made: list[Path] = []
    with _one_line(path):
        try:
            made = make_missing(Path(path).parent, public=public)
            with _unfinished_in(Path(path).parent) as unfinished:
                with open(unfinished, "xb", opener=None if public else open_private) as stream:
                    yield stream
                unfinished.replace(path)
        except BaseException:
            with suppress(OSError):
                for folder in reversed(made):
                    folder.rmdir()
            raise


def atomic_write_bytes(
    path: str | os.PathLike[str], content: bytes, *, public: bool = False
) -> None:
    """Write `content` to a file as `atomic_write` does."""
    with atomic_write(path, public=public) as stream:
        stream.write(content)


def check_writable(
    path: str | os.PathLike[str], *, what: str = "", suffixes: Collection[str] = ()
) -> None:
    """Raise OutputError if a file could not be written, before hours of work go into it.

    Where `suffixes` are given, `what` is to be written needs one of them. Nothing is left behind.
    """
    target = Path(path)
    if suffixes and target.suffix.lower() not in suffixes:
        raise OutputError(f"{path}: {what} is written as {' or '.join(suffixes)}")
    with _one_line(path):
        there = next((folder for folder in target.parents if folder.exists()), Path())
        with _unfinished_in(there) as trial:
            trial.write_bytes(b" ")  # a byte, since a full disk may still take an empty file


def make_missing(folder: Path, *, public: bool = False) -> list[Path]:
    """Make a folder and its parents where they are missing; return these; raises OSError."""
    made = []
    for place in reversed([folder, *folder.parents]):
        if not place.is_dir():
            place.mkdir(0o777 if public else PRIVATE_FOLDER, exist_ok=True)
            if not public:
                place.chmod(PRIVATE_FOLDER)
            made.append(place)
    return made


def open_private(path: str, flags: int) -> int:
    """Open a file that only its owner may read: an opener of `open`."""
    handle = os.open(path, flags, PRIVATE_FILE)
    Path(path).chmod(PRIVATE_FILE)  # where the umask withholds rights from the owner, too
    return handle


def reason(error: OSError) -> str:
    """Return the system's message about a failure, in lower case."""
    return (error.strerror or str(error)).lower()
