"""Files appear whole or not at all: written beside their place, then moved there."""

from __future__ import annotations

import re
import secrets
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
def atomic_write(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open an unfinished file beside `path` that takes its place once all went well.

    Parameters
    ----------
    path : path-like
        The file to write or replace; its folder must exist.

    Yields
    ------
    BinaryIO
        The unfinished file; where the block raises, it is removed and `path` stays as it was.

    Raises
    ------
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with atomic_write(Path(folder, "scores.csv")) as stream:
    ...         _ = stream.write(b"score")
    ...     Path(folder, "scores.csv").read_bytes()
    b'score'
    """
    target = Path(path)
    if target.is_dir():
        raise OutputError(f"{path}: cannot be written: it is a folder")
    unfinished = target.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with unfinished.open("xb") as stream:
            yield stream
        unfinished.replace(target)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {reason(error)}") from error
    finally:
        if unfinished.exists():
            unfinished.unlink()


def atomic_write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Write `content` to a file that appears whole or not at all.

    Parameters
    ----------
    path : path-like
        The file to write or replace; its folder must exist.
    content : bytes
        What to write.

    Raises
    ------
    OutputError
        If the file cannot be written; nothing is left behind then.
    """
    with atomic_write(path) as stream:
        stream.write(content)


def check_writable(path: str | os.PathLike[str]) -> None:
    """Refuse a file that could not be written, before hours of work go into it.

    Parameters
    ----------
    path : path-like
        A file that is to be written later.

    Raises
    ------
    OutputError
        If `path` is a folder, or nothing can be written beside it.
    """
    target = Path(path)
    if target.is_dir():
        raise OutputError(f"{path}: cannot be written: it is a folder")
    trial = target.with_name(f".{secrets.token_hex(8)}.part")
    try:
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {reason(error)}") from error


def make_folder(path: str | os.PathLike[str]) -> None:
    """Make a folder and its parents where they are missing.

    Raises
    ------
    OutputError
        If it cannot be made.
    """
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot be made a folder: {reason(error)}", path=path) from error


def remove_unfinished(folder: str | os.PathLike[str]) -> None:
    """Remove the unfinished files that a killed process left in a folder.

    Parameters
    ----------
    folder : path-like
        A folder that no other process writes to.

    Raises
    ------
    OSError
        If the folder cannot be listed or a file cannot be removed.
    """
    for path in Path(folder).iterdir():
        if _UNFINISHED.fullmatch(path.name):
            path.unlink()


def reason(error: OSError) -> str:
    """Return the system's message about a failure, in lower case."""
    return (error.strerror or str(error)).lower()
