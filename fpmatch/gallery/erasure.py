"""Erasure of what was removed from a gallery: in its file, and in its index."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from fpmatch.errors import FpmatchError
from fpmatch.gallery.store.kept_files import PREPARED, delete_files, kept_files, kept_folders
from fpmatch.gallery.store.tables import TABLES

if TYPE_CHECKING:
    from collections.abc import Collection

    from fpmatch.gallery.store.reader import GalleryReader


def erase_traces(gallery: GalleryReader, numbers: Collection[int]) -> None:
    """Erase what is left of entries that were just removed, by their numbers.

    What is deleted from a SQLite file is overwritten at once; one that an earlier version has
    changed, which did not, is rewritten. Raises GalleryError (code "traces") if that cannot be
    done.
    """
    try:
        delete_outdated(gallery, numbers)
        if gallery.file is not None and not gallery.is_overwritten():
            gallery.vacuum(TABLES)
    except FpmatchError as error:
        why = error.detail or str(error)
        raise gallery.error(
            f"removed, but traces may be left: {why}; `fpmatch gallery rewrite` erases them",
            "traces",
        ) from error


def delete_outdated(gallery: GalleryReader, numbers: Collection[int] | None = None) -> None:
    """Write the index anew where it has removed prints, all or some, and delete empty folders.

    Files of prepared prints, which version 0.2 made, are deleted.
    """
    from fpmatch.gallery.index.follow import erase_removed  # noqa: PLC0415  (imports an index)

    erase_removed(gallery, numbers)
    delete_files(gallery, PREPARED)
    for folder in kept_folders(gallery):
        with suppress(OSError):
            folder.rmdir()


def size_of_index(gallery: GalleryReader) -> int:
    """Return the bytes of the index of a gallery."""
    size = 0
    for path in kept_files(gallery):
        with suppress(OSError):
            size += path.stat().st_size
    return size
