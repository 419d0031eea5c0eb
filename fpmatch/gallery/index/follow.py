"""The index of a large gallery: it follows the database as entries are added and removed.

The database is the only truth. By its history (see `fpmatch.gallery.store.history`) the index finds
what was changed since it was written, by this program or any other; where that is not known, or a
file is damaged, the index, or the damaged segment, is built again, with a note. Files are read and
written while their folder is locked; where that is impossible, the index is kept in memory.
"""

from __future__ import annotations

from contextlib import closing, suppress
from dataclasses import replace
from functools import cached_property
from itertools import islice, takewhile
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.folders import make_folder
from fpmatch.base.output import reason
from fpmatch.errors import FpmatchError, GalleryError, OutputError
from fpmatch.gallery.engine.engine import processes, serial
from fpmatch.gallery.engine.folder_lock import folder_lock
from fpmatch.gallery.engine.workers import no_progress
from fpmatch.gallery.index.files import IndexFolder, IndexList, Listed, index_folders
from fpmatch.gallery.index.segment import MOST_PRINTS, Segment
from fpmatch.gallery.store.history import UNKNOWN
from fpmatch.gallery.store.kept_files import FAULTS, INDEX, SEGMENT, kept_folders
from fpmatch.gallery.store.stored_template import unpack_template

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.matching.result import Matcher

PRINTS_PER_CHUNK: Final = 256
_NO_NUMBERS: Final = np.empty(0, np.int64)
FEW: Final = 512  # prints that this process adds alone


class GalleryIndex:
    """Follow a gallery with an index of its prints, prepared by a matcher.

    `engine` prepares prints (default: all cores), `progress` is called with stage "prepare" and
    numbers of prints, and `note` with a line on what could not be used or written.
    """

    def __init__(
        self,
        matcher: Matcher,
        *,
        engine: Engine | None = None,
        progress: Progress = no_progress,
        note: Callable[[str], object] = lambda _: None,
    ) -> None:
        self.matcher = matcher
        self._engine, self._progress, self._note = engine, progress, note
        self._noted = False  # whether a note states where the files are
        self._list = IndexList()
        self._read: dict[str, Segment] = {}

    @property
    def damaged(self) -> list[int]:
        """The numbers of the entries that are damaged."""
        damaged: list[int] = self._list.damaged.tolist()
        return damaged

    @property
    def segments(self) -> list[Segment]:
        """The segments of the index, as it followed the gallery last."""
        return [self._read[one.name] for one in self._list.segments]

    @cached_property
    def stored(self) -> NDArray[np.intp]:
        """The places, in all segments, of the prints that were not removed."""
        return np.flatnonzero(~np.isin(self._all_numbers, self._list.removed))

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """The numbers of the entries of these prints, ascending."""
        return self._all_numbers[self.stored]

    @property
    def _all_numbers(self) -> NDArray[np.int64]:
        return np.concatenate([_NO_NUMBERS, *(segment.number for segment in self.segments)])

    def follow(self, gallery: GalleryReader) -> None:
        """Let the index have all entries that are in the gallery now.

        If it has not changed, that takes one short query. Raises GalleryError where the gallery
        cannot be read.
        """
        if self._list.revision == gallery.revision():
            return
        gallery.check_keys()
        folders, why = index_folders(gallery, self.matcher.name), ""
        for folder in folders:
            try:
                make_folder(folder.path, narrow=True)
                with folder_lock(folder.path):
                    self._update(gallery, folder, write=True)
                if why:
                    self._say_once(f"the index of {gallery.name} is kept in {folder.path}: {why}")
                break
            except OutputError as error:
                why = why or error.detail or str(error)
            except OSError as error:
                why = why or reason(error)
        else:
            self._update(gallery, folders[0], write=False)
            self._say_once(f"the index of {gallery.name} is kept in memory: {why}")
        for number in self.damaged:
            if number not in gallery.damaged:
                with suppress(GalleryError):
                    gallery.find_template(number)

    def _say_once(self, text: str) -> None:
        if not self._noted:
            self._note(text)
        self._noted = True

    def _update(self, gallery: GalleryReader, folder: IndexFolder, *, write: bool) -> None:
        """Take the list of a folder, without what was removed since, and add what was enrolled."""
        now = gallery.revision()
        listed = self._newest_list(gallery, folder, write=write)
        after = listed.revision.last
        if not listed.segments or after < now.last:
            gallery.check_whole(self._note, after=after)
        gone = set(listed.removed.tolist()).difference(self._list.removed.tolist())
        if listed.segments and gone:
            gallery.check_sums(of=gone)
        listed = self._with_segments_read(gallery, folder, listed, write=write)
        done = sum(one.prints for one in listed.segments) - len(listed.removed)
        total = len(gallery)
        for segment, last in self._built(gallery, after, now.last, done, total):
            listed = self._with_segment(listed, segment)
            damaged = [k for k in gallery.damaged if after < k <= last]
            listed = replace(
                listed,
                revision=replace(now, last=last),
                damaged=np.union1d(listed.damaged, np.array(damaged, np.int64)),
            )
            if write:
                self._write(listed, folder)
        self._list = replace(listed, revision=now)
        self._read = {one.name: self._read[one.name] for one in listed.segments}
        for name in ("stored", "numbers"):
            self.__dict__.pop(name, None)

    def _newest_list(
        self, gallery: GalleryReader, folder: IndexFolder, *, write: bool
    ) -> IndexList:
        """Return the list in a folder, or in memory, without what was removed; empty if none is."""
        fault = ""
        try:
            listed = masked(gallery, folder.read_list())
        except FpmatchError as error:
            listed, fault = None, error.code
        if not write and self._list.segments:
            ours = masked(gallery, self._list)
            if ours and (listed is None or ours.revision.last > listed.revision.last):
                return ours
        if listed is None and fault != "missing":
            self._say_built_again(f"files of the index of {gallery.name}", fault or "other")
        return listed or IndexList()

    def _with_segments_read(
        self, gallery: GalleryReader, folder: IndexFolder, listed: IndexList, *, write: bool
    ) -> IndexList:
        """Return the list with segments that are read, and those that are damaged built again."""
        segments: list[Listed] = []
        for one in listed.segments:
            try:
                if one.name not in self._read:
                    self._read[one.name] = folder.read_segment(one)
                segments.append(one)
            except FpmatchError as error:
                self._say_built_again(f"segments of the index of {gallery.name}", error.code)
                for segment, _ in self._built(gallery, one.first - 1, one.last):
                    segments.append(self._kept(segment))
        if segments == [*listed.segments]:
            return listed
        now = replace(listed, segments=tuple(segments))
        if write:
            self._write(now, folder)
        return now

    def _built(
        self, gallery: GalleryReader, after: int, last: int, done: int = 0, total: int = 0
    ) -> Iterator[tuple[Segment, int]]:
        """Yield segments of the entries between two numbers, and up to which number they are."""
        rows = gallery.packed_templates(after=after) if after < last else iter(())
        wanted = takewhile(lambda row: row[0] <= last, rows)
        while some := list(islice(wanted, MOST_PRINTS)):
            segment = self._segment_of(gallery, some, done, total)
            done += len(some)
            if segment is not None:
                yield segment, some[-1][0] if len(some) == MOST_PRINTS else last

    def _segment_of(
        self, gallery: GalleryReader, rows: Sequence[tuple[int, bytes]], done: int, total: int
    ) -> Segment | None:
        """Return a segment of those packed templates that are sound; None where none is."""
        chunks = [rows[k : k + PRINTS_PER_CHUNK] for k in range(0, len(rows), PRINTS_PER_CHUNK)]
        engine = serial() if len(rows) <= FEW else self._engine or processes()
        parts: list[Segment] = []
        with engine, closing(engine.map(_build, self.matcher, chunks)) as results:
            for chunk, (part, failed) in zip(chunks, results, strict=True):
                gallery.damaged |= failed
                parts += [part] if len(part) else []
                done += len(chunk)
                if len(rows) > FEW:
                    self._progress("prepare", min(done, total), total)
        return Segment.concatenate(parts) if parts else None

    def _kept(self, segment: Segment) -> Listed:
        """Return how a new segment is listed."""
        listed = Listed.of(segment)
        self._read[listed.name] = segment
        return listed

    def _with_segment(self, listed: IndexList, segment: Segment) -> IndexList:
        """Return a list with another segment, merged with those before that are not much larger.

        So a print is copied a few times only where prints are added one by one.
        """
        segments = [*listed.segments]
        while segments:
            before = segments[-1]
            if (
                before.prints > max(2 * len(segment), 1)
                or before.prints + len(segment) > MOST_PRINTS
            ):
                break
            segment = Segment.concatenate([self._read[before.name], segment])
            segments.pop()
        return replace(listed, segments=(*segments, self._kept(segment)))

    def _write(self, listed: IndexList, folder: IndexFolder) -> None:
        """Write the list, and the segments that are in no file; raise OutputError."""
        there = {path.name for path in folder.path.iterdir()}
        for one in listed.segments:
            if not any(one.name in name for name in there):
                folder.write_segment(one, self._read[one.name])
                self._read[one.name] = folder.read_segment(one)
        folder.write_list(listed)

    def _say_built_again(self, what: str, fault: str) -> None:
        self._note(f"{what} {FAULTS.get(fault, FAULTS['damaged'])}: built again")


def masked(gallery: GalleryReader, listed: IndexList) -> IndexList | None:
    """Return a list with what was removed since from the gallery; None if that is not known."""
    before, now = listed.revision, gallery.revision()
    if before.removals == UNKNOWN:
        return listed if replace(before, last=now.last) == now else None
    removals = gallery.removals_since(before)
    if removals is None:
        return None
    gone = np.array([one.entry for one in removals], np.int64)
    damaged = np.setdiff1d(listed.damaged, gone)
    in_segments = np.setdiff1d(gone[gone <= before.last], listed.damaged)
    removed = np.union1d(listed.removed, in_segments)
    revision = replace(now, last=before.last)
    return replace(listed, revision=revision, removed=removed, damaged=damaged)


def erase_removed(gallery: GalleryReader) -> None:
    """Write the segments that have removed prints anew, in all folders.

    An index that is damaged, or cannot be written, is deleted. Raises FpmatchError if a file cannot
    be.
    """
    for path in kept_folders(gallery):
        files = [*path.glob(f"*{INDEX}"), *path.glob(f"*{SEGMENT}")]
        for name in sorted({one.name.partition(".")[0] for one in files}):
            folder = IndexFolder(path, name, gallery.sealing())
            with folder_lock(path):
                try:
                    listed = masked(gallery, folder.read_list())
                    kept = () if listed is None else tuple(_erased(folder, listed))
                    listed = replace(listed or IndexList(), segments=kept, removed=_NO_NUMBERS)
                    folder.write_list(listed)
                except FpmatchError:  # the next search makes it again
                    folder.delete()
                else:
                    folder.delete_others(kept, strict=True)


def _erased(folder: IndexFolder, listed: IndexList) -> Iterator[Listed]:
    """Yield the segments of a list, those that had removed prints written without them."""
    for one in listed.segments:
        first, last = np.searchsorted(listed.removed, [one.first, one.last + 1])
        if first == last:
            yield one
            continue
        segment = folder.read_segment(one)
        left = np.flatnonzero(~np.isin(segment.number, listed.removed))
        if len(left) == len(segment):
            yield one
        elif len(left):
            segment = segment.take(left)
            written = Listed.of(segment)
            folder.write_segment(written, segment)
            yield written


def _build(matcher: Matcher, rows: Sequence[tuple[int, bytes]]) -> tuple[Segment, dict[int, str]]:
    """Return a segment of those packed templates that are sound, and why others are not."""
    numbers, prints, damaged = [], [], {}
    for number, data in rows:
        try:
            prints.append(matcher.prepare(unpack_template(data)))
            numbers.append(number)
        except FpmatchError as error:
            damaged[number] = str(error)
    return Segment.build(numbers, prints), damaged
