"""Space that a gallery frees: all that is unused or outdated (``fpmatch gallery rewrite``)."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from fpmatch.gallery.erasure import delete_outdated
from fpmatch.gallery.store.kept_files import kept_files

if TYPE_CHECKING:
    from fpmatch.gallery.gallery import Gallery


def free_space(gallery: Gallery) -> dict[str, dict[str, int]]:
    """Rewrite the database without free space, and the index without removed prints.

    Returns their bytes "before" and "after", of the "database" and of the "prepared" index. On
    PostgreSQL, the tables of galleries are rewritten by ``VACUUM FULL``. Raises GalleryError if
    another program holds the gallery, the disk is full, or a file cannot be deleted; the gallery is
    as before.
    """
    before = gallery.size(), _size_of_index(gallery)
    gallery.record("compact")
    gallery.vacuum()
    delete_outdated(gallery)
    sizes = zip(before, (gallery.size(), _size_of_index(gallery)), strict=True)
    database, index = ({"before": one, "after": other} for one, other in sizes)
    return {"database": database, "prepared": index}


def _size_of_index(gallery: Gallery) -> int:
    size = 0
    for path in kept_files(gallery):
        with suppress(OSError):
            size += path.stat().st_size
    return size
