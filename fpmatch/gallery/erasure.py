"""Erasure of what was removed from a gallery in its index, which is beside the database."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from fpmatch.errors import FpmatchError
from fpmatch.gallery.store.kept_files import PREPARED, delete_files, kept_folders
from fpmatch.matching.compiled import COMPILED

if TYPE_CHECKING:
    from collections.abc import Collection

    from fpmatch.gallery.store.gallery import Gallery


def erase_traces(gallery: Gallery, numbers: Collection[int]) -> None:
    """Erase what is left of entries that were just removed, by their numbers.

    What is deleted from a SQLite file is overwritten at once. Raises GalleryError (code "traces")
    if files of the index cannot be changed.
    """
    try:
        delete_outdated(gallery, numbers)
    except FpmatchError as error:
        why = error.detail or str(error)
        raise gallery.error(
            f"removed, but traces may be left: {why}; `fpmatch gallery rewrite` erases them",
            "traces",
        ) from error


def delete_outdated(gallery: Gallery, numbers: Collection[int] | None = None) -> None:
    """Write the index anew where it has removed prints, all or some, and delete empty folders.

    Files of prepared prints, which version 0.2 made, are deleted; where kernels are not compiled,
    which an index needs, the index is.
    """
    if COMPILED:
        from fpmatch.gallery.index.follow import erase_removed  # noqa: PLC0415  (imports kernels)

        erase_removed(gallery, numbers)
        delete_files(gallery, PREPARED)
    else:
        delete_files(gallery)
    for folder in kept_folders(gallery):
        with suppress(OSError):
            folder.rmdir()
