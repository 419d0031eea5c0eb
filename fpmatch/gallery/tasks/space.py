"""Space that a gallery frees: all that is unused or outdated (``fpmatch gallery rewrite``)."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fpmatch.gallery.erasure import delete_outdated
from fpmatch.gallery.store.kept_files import kept_files

if TYPE_CHECKING:
    from fpmatch.gallery.gallery import Gallery


@dataclass(frozen=True, slots=True)
class FreedSpace:
    """Sizes in bytes before and after: of the database, and of the index."""

    database_before: int
    database_after: int
    prepared_before: int
    prepared_after: int

    def as_dict(self) -> dict[str, Any]:
        """Return the sizes as JSON values."""
        return {
            "database": {"before": self.database_before, "after": self.database_after},
            "prepared": {"before": self.prepared_before, "after": self.prepared_after},
        }


def free_space(gallery: Gallery) -> FreedSpace:
    """Rewrite the database without free space, and the index without removed prints.

    On PostgreSQL, the tables of galleries are rewritten by ``VACUUM FULL``. Raises GalleryError if
    another program holds the gallery, the disk is full, or a file cannot be deleted; the gallery is
    as before.
    """
    before = gallery.size(), _size_of_index(gallery)
    gallery.record("compact")
    gallery.vacuum()
    delete_outdated(gallery)
    return FreedSpace(before[0], gallery.size(), before[1], _size_of_index(gallery))


def _size_of_index(gallery: Gallery) -> int:
    size = 0
    for path in kept_files(gallery):
        with suppress(OSError):
            size += path.stat().st_size
    return size
