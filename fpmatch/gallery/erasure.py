"""Erasure of what was removed from a gallery: in its file, its prepared prints and its index."""

from __future__ import annotations

from contextlib import suppress
from itertools import islice
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.base.output import reason
from fpmatch.errors import FpmatchError, GalleryError
from fpmatch.gallery.engine.folder_lock import folder_lock
from fpmatch.gallery.index.files import IndexFolder
from fpmatch.gallery.index.prepared import Prepared, load_prepared, prepared_name, save_prepared
from fpmatch.gallery.index.state import read_present
from fpmatch.gallery.store.kept_files import INDEX, PREPARED, SEGMENT, kept_folders
from fpmatch.gallery.store.tables import TABLES
from fpmatch.matching.registry import get_matcher

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from fpmatch.gallery.index.files import Listed
    from fpmatch.gallery.index.print_segment import PrintSegment
    from fpmatch.gallery.store.reader import GalleryReader

_PATTERNS: Final = (f"*{PREPARED}", "*.prints", "*.npy", ".*.part")
"""Files of prepared prints: of this version, of earlier ones, and unfinished ones."""
WRITTEN_AT_ONCE: Final = 16  # segments, while the folder of an index is locked


def erase_traces(gallery: GalleryReader, before: str) -> None:
    """Erase what is left of entries that were just removed.

    `before` is the content hash from before: prepared prints of it are copied without those of the
    removed entries. What is deleted from a SQLite file is overwritten at once; one that an earlier
    version has changed, which did not, is rewritten. Raises GalleryError (code "traces") if that
    cannot be done.
    """
    try:
        _renew(gallery, before)
        delete_outdated(gallery)
        if gallery.file is not None and not gallery.is_overwritten():
            gallery.vacuum(TABLES)
    except FpmatchError as error:
        why = error.detail or str(error)
        raise gallery.error(
            f"removed, but traces may be left: {why}; `fpmatch gallery rewrite` erases them",
            "traces",
        ) from error


def _renew(gallery: GalleryReader, before: str) -> None:
    """Copy the prepared prints of the content `before` that are still enrolled."""
    ending = f"-{__version__}-{before}{PREPARED}"
    files = [path for path in _files(gallery) if path.name.endswith(ending)]
    if not files:
        return
    content, sealing, fingers = gallery.content_hash(), gallery.sealing(), gallery.fingers()
    for path in files:
        with suppress(FpmatchError):  # then the next search prepares all
            matcher = get_matcher(path.name.removesuffix(ending))
            old = load_prepared(path, matcher, sealing)
            left = np.flatnonzero(np.isin(old.numbers, list(fingers)))
            numbers = old.numbers[left]
            of_fingers = np.array([fingers[number] for number in numbers.tolist()], np.int64)
            new = Prepared(numbers, of_fingers, old.digests[left], old.prints.take(left))
            save_prepared(path.with_name(prepared_name(matcher, content)), new, matcher, sealing)


def delete_outdated(gallery: GalleryReader) -> None:
    """Delete all prepared prints but those of the present content, and folders left empty.

    The index is written anew where it has removed prints.
    """
    _erase_from_index(gallery)
    ending = f"-{__version__}-{gallery.content_hash()}{PREPARED}"
    for path in _files(gallery):
        if not path.name.endswith(ending):
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                why = f"cannot be deleted: {reason(error)}"
                raise GalleryError(f"{path.name}: {why}", path=gallery.name) from error
    for folder in kept_folders(gallery):
        with suppress(OSError):
            folder.rmdir()


def _erase_from_index(gallery: GalleryReader) -> None:
    """Write the segments that have removed prints anew, or delete them for the next search."""
    for path in kept_folders(gallery):
        names = {one.name.removesuffix(INDEX) for one in path.glob(f"*{INDEX}")}
        names |= {one.name.partition(".")[0] for one in path.glob(f"*{SEGMENT}")}
        for name in sorted(names):
            with suppress(FileNotFoundError):
                _rewrite(gallery, IndexFolder(path, name, gallery.sealing()))


def _rewrite(gallery: GalleryReader, folder: IndexFolder) -> None:
    """Erase what was removed from the index in a folder, some segments after the others.

    The folder is locked while files are read and written, so that searches can use it in between.
    """
    new: dict[Listed, PrintSegment] = {}
    while True:
        with folder_lock(folder.path):
            try:
                state = read_present(gallery, folder)
                for part in state.parts:
                    if part.listed in new:
                        state = state.erased(part, new[part.listed])
                state = state.write(folder)
                affected = (part for part in state.parts if part.may_contain(state.removed))
                old = list(islice(affected, WRITTEN_AT_ONCE))
                for part in old:
                    part.segment  # noqa: B018  (read before another program can delete it)
                kept = [part.listed for part in state.parts]
            except FpmatchError:
                folder.delete_list()
                kept, old = [], []
            folder.delete_others(kept, strict=True)
        if not old:
            return
        new = {part.listed: part.without(state.removed) for part in old}


def _files(gallery: GalleryReader, patterns: Iterable[str] = _PATTERNS) -> Iterator[Path]:
    for folder in kept_folders(gallery):
        for pattern in patterns:
            yield from folder.glob(pattern)


def size_of_prepared(gallery: GalleryReader) -> int:
    """Return the bytes of all prepared prints of a gallery, and of its index."""
    sizes = 0
    for path in _files(gallery, (*_PATTERNS, f"*{SEGMENT}", f"*{INDEX}")):
        with suppress(OSError):
            sizes += path.stat().st_size
    return sizes
