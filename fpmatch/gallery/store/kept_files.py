"""Files that are kept to search a gallery faster: their places, and their encryption.

They are caches of its database, in ``prints.db.prepared/``, or in the user's cache folder where
that is impossible, as for PostgreSQL. They may be deleted at any time.
"""

from __future__ import annotations

import hashlib
from contextlib import nullcontext, suppress
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import atomic_write
from fpmatch.errors import FpmatchError
from fpmatch.gallery.store.blocks import MAGIC
from fpmatch.gallery.store.sealing import PLAIN

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager
    from pathlib import Path
    from typing import BinaryIO

    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.gallery.store.sealing import Sealing

PREPARED: Final = ".arrays"
SEGMENT: Final = ".segment"
INDEX: Final = ".index"
SUFFIXES: Final = (PREPARED, SEGMENT, INDEX)
"""Of files of prepared prints; of segments of an index; of the list of these."""

STALE_S: Final = 3600.0  # age of an unfinished file that no process writes any more
FAULTS: Final = {
    "damaged": "are damaged",
    "other": "are of another version or gallery",
    "unreadable": "cannot be read",
}
"""What is wrong with files, by the code of the error."""


def kept_folders(gallery: GalleryReader) -> list[Path]:
    """Return the folders for kept files, the preferred one first."""
    from platformdirs import user_cache_path  # noqa: PLC0415

    file = gallery.file
    name = gallery.name if file is None else str(file.absolute())
    cache = user_cache_path("fpmatch") / "galleries"
    beside = [] if file is None else [file.with_name(f"{file.name}.prepared")]
    return [*beside, cache / hashlib.sha256(name.encode("utf-8", "replace")).hexdigest()[:32]]


def seal_files(gallery: GalleryReader) -> None:
    """Encrypt all files of a gallery as it is encrypted now; those that cannot be are removed."""
    sealing = gallery.sealing()
    seal = seal_of(sealing)
    for path in (path for folder in kept_folders(gallery) for path in folder.glob("*")):
        try:
            content = _content(path, sealing) if path.suffix in SUFFIXES else None
            if content is not None:
                with atomic_write(path) as stream, seal(stream) as sealed:
                    sealed.write(content)
        except (FpmatchError, OSError):
            content = None
        if content is None:
            with suppress(OSError):
                path.unlink()


def seal_of(sealing: Sealing | None) -> Callable[[BinaryIO], AbstractContextManager[Any]]:
    """Return what yields the stream to write the content of a file to."""
    return nullcontext if sealing is None or not sealing.encrypts else sealing.sealed_file


def unseal_of(sealing: Sealing | None) -> Callable[[BinaryIO], memoryview] | None:
    """Return what decrypts the content of a file; None where files are not encrypted."""
    return sealing.unsealed_file if sealing is not None and sealing.encrypts else None


def _content(path: Path, sealing: Sealing | None) -> bytes | memoryview | None:
    """Return the content of a file, None for one that is not encrypted but should be."""
    with path.open("rb") as stream:
        if sealing is not None and stream.read(len(MAGIC)) == MAGIC:
            return sealing.unsealed_file(stream)
        stream.seek(0)
        return stream.read() if sealing is None or PLAIN in sealing.keys else None
