"""Files appear whole or not at all: written beside their place, then moved there."""

from __future__ import annotations

import re
import secrets
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from fpmatch.errors import OutputError

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator
    from typing import BinaryIO

_UNFINISHED = re.compile(r"\.[0-9a-f]{16}\.part")


@contextmanager
def _unfinished_beside(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield the path of an unfinished file, and remove it; an OSError becomes an OutputError."""
    target = Path(path)
    if target.is_dir():
        raise OutputError(f"{path}: cannot be written: it is a folder")
    unfinished = target.with_name(f".{secrets.token_hex(8)}.part")
    try:
        yield unfinished
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {reason(error)}") from error
    finally:
        if unfinished.exists():
            unfinished.unlink()


@contextmanager
def atomic_write(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Yield an unfinished file beside `path`, which replaces it once the block has ended well.

    Raises OutputError if the file cannot be written; nothing is left behind then.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with atomic_write(Path(folder, "scores.csv")) as stream:
    ...         _ = stream.write(b"score")
    ...     Path(folder, "scores.csv").read_bytes()
    b'score'
    """
    with _unfinished_beside(path) as unfinished:
        with unfinished.open("xb") as stream:
            yield stream
        unfinished.replace(path)


def atomic_write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Write `content` to a file as `atomic_write` does."""
    with atomic_write(path) as stream:
        stream.write(content)


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise OutputError if a file could not be written, before hours of work go into it."""
    with _unfinished_beside(path) as trial:
        trial.touch(exist_ok=False)


def make_folder(path: str | os.PathLike[str]) -> None:
    """Make a folder and its parents where they are missing; raise OutputError if that fails."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot be made a folder: {reason(error)}", path=path) from error


def remove_unfinished(folder: str | os.PathLike[str], *, older_than_s: float = 0.0) -> None:
    """Remove what killed processes left unfinished in a folder.

    `older_than_s` leaves the files of processes that may still write to it.
    """
    latest = time.time() - older_than_s
    for path in Path(folder).iterdir():
        if _UNFINISHED.fullmatch(path.name) and not (
            older_than_s and path.stat().st_mtime > latest
        ):
            path.unlink()


def reason(error: OSError) -> str:
    """Return the system's message about a failure, in lower case."""
    return (error.strerror or str(error)).lower()
