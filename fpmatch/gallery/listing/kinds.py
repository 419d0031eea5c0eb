"""What a path or URL that is given for prints leads to."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

from fpmatch.base.parsing import read_head
from fpmatch.gallery.listing.manifest import is_manifest

if TYPE_CHECKING:
    import os

SQLITE_HEADER: Final = b"SQLite format 3\0"

Kind = Literal["gallery", "manifest", "folder", "file"]


def kind_of(place: str | os.PathLike[str]) -> Kind:
    """Return whether a path or URL leads to a gallery, a manifest, a folder or any other file.

    Where nothing is, it is a "folder".

    Examples
    --------
    >>> kind_of("postgresql://me@host/prints"), kind_of("nowhere")
    ('gallery', 'folder')
    """
    path = Path(place)
    if "://" in str(place):
        return "gallery"
    if not path.is_file():
        return "folder"
    if read_head(path).startswith(SQLITE_HEADER):
        return "gallery"
    return "manifest" if is_manifest(path) else "file"
