"""Erasure of removed prints from the files of an index."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from fpmatch.base.output import folder_lock
from fpmatch.errors import FpmatchError
from fpmatch.gallery.index_files import IndexFolder
from fpmatch.gallery.index_state import IndexState, removals_between
from fpmatch.gallery.kept_files import INDEX, SEGMENT, kept_folders

if TYPE_CHECKING:
    from fpmatch.gallery.reader import GalleryReader


def erase_from_index(gallery: GalleryReader) -> None:
    """Write the segments anew that have removed prints; delete them where that is impossible.

    What is deleted is built again by the next search. Raises FpmatchError if a file cannot be
    deleted.
    """
    for path in kept_folders(gallery):
        names = {one.name.removesuffix(INDEX) for one in path.glob(f"*{INDEX}")}
        names |= {one.name.partition(".")[0] for one in path.glob(f"*{SEGMENT}")}
        for name in sorted(names):
            with suppress(FileNotFoundError), folder_lock(path):
                _erase(gallery, IndexFolder(path, name, gallery.sealing()))


def _erase(gallery: GalleryReader, folder: IndexFolder) -> None:
    """Erase what was removed from the index in a folder, which is locked."""
    now = gallery.revision()
    try:
        listed = folder.read_list()
        removals = removals_between(gallery, listed.revision, now)
        if removals is None:
            raise FpmatchError("of another gallery", code="other")
        state = IndexState.of_list(listed, folder).after(removals, now).rewritten()
        kept = state.write(folder).base
    except FpmatchError:
        folder.delete_list()
        kept = None
    folder.delete_others(() if kept is None else kept[1], strict=True)
