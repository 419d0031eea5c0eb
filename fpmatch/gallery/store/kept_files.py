"""Files that are kept to search a gallery faster: their places.

They are caches of its database, in ``prints.db.prepared/``, or in the user's cache folder where
that is impossible, as for PostgreSQL. They may be deleted at any time.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Final

from fpmatch.base.output import reason

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from fpmatch.gallery.store.database import Database

SEGMENT: Final = ".segment"
INDEX: Final = ".index"
"""Of files of segments of an index; of the list of these."""
PREPARED: Final = ("*.arrays", ".*.part")
"""Of files of prepared prints, which version 0.2 made, and of unfinished files."""
PATTERNS: Final = (f"*{SEGMENT}", f"*{INDEX}", *PREPARED)
"""Of all files."""

STALE_S: Final = 3600.0  # age of an unfinished file that no process writes any more
FAULTS: Final = {
    "damaged": "are damaged",
    "other": "are of another version or gallery",
    "unreadable": "cannot be read",
}
"""What is wrong with files, by the code of the error."""


def kept_folders(gallery: Database) -> list[Path]:
    """Return the folders for kept files, the preferred one first."""
    from platformdirs import user_cache_path  # noqa: PLC0415

    file = gallery.file
    name = gallery.name if file is None else str(file.absolute())
    cache = user_cache_path("fpmatch") / "galleries"
    beside = [] if file is None else [file.with_name(f"{file.name}.prepared")]
    return [*beside, cache / hashlib.sha256(name.encode("utf-8", "replace")).hexdigest()[:32]]


def kept_files(gallery: Database, patterns: Iterable[str] = PATTERNS) -> Iterator[Path]:
    """Yield the files of all versions, unfinished ones too, or those of some patterns."""
    for folder in kept_folders(gallery):
        for pattern in patterns:
            yield from folder.glob(pattern)


def delete_files(gallery: Database, patterns: Iterable[str] = PATTERNS) -> None:
    """Delete files of some patterns; raise GalleryError if one cannot be deleted."""
    for path in kept_files(gallery, patterns):
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise gallery.error(f"{path.name}: cannot be deleted: {reason(error)}") from error
