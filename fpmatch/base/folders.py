"""Private folders: make them, write files into them, remove what killed processes left there."""

from __future__ import annotations

import os
import re
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from fpmatch.base.output import atomic_write_bytes, make_missing, open_private, reason
from fpmatch.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Mapping

_OTHERS = 0o077  # rights of group and others
_UNFINISHED = re.compile(r"\.[0-9a-f]{16}\.part")


def make_folder(
    path: str | os.PathLike[str], *, public: bool = False, narrow: bool = False
) -> None:
    """Make a folder and its parents where they are missing; raise OutputError if that fails.

    Only their owner may list them, unless they are `public`. An existing folder keeps its rights,
    unless `narrow`.
    """
    folder = Path(path)
    try:
        make_missing(folder, public=public)
        if narrow:
            make_private(folder)
    except OSError as error:
        raise OutputError(f"cannot be made a folder: {reason(error)}", path=path) from error


def write_files(
    contents: Mapping[str, bytes], folder: str | os.PathLike[str], *, public: bool = False
) -> list[Path]:
    """Write files, by name, into a folder, made if missing; each appears complete or not at all."""
    target = Path(folder)
    make_folder(target, public=public)
    for name, content in contents.items():
        atomic_write_bytes(target / name, content, public=public)
    return [target / name for name in contents]


def make_private(path: str | os.PathLike[str]) -> bool:
    """Remove the rights of others on a file or folder; return whether only the owner has any.

    Where the group may write, as in a shared gallery, the group keeps its rights. Files of other
    users stay as they are.
    """
    place = Path(path)
    if os.name == "nt":  # there, rights are inherited from the folder
        return True
    with suppress(OSError):
        mode = place.stat().st_mode & 0o7777
        if mode & _OTHERS:
            place.chmod(mode & ~(0o007 if mode & 0o020 else _OTHERS))
        return not place.stat().st_mode & _OTHERS
    return False


def create_private(path: str | os.PathLike[str]) -> None:
    """Make an empty file that only its owner may read, where there is none; raises OSError."""
    with suppress(FileExistsError):
        os.close(open_private(os.fspath(path), os.O_WRONLY | os.O_CREAT | os.O_EXCL))


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
