"""The index of a large gallery: it follows the database as entries are added and removed.

The database is the only truth. Where its state has changed, by this program or any other, the
index compares the numbers and digests of all entries with its own: it masks what was removed, and
adds what is new. Where they do not fit, or a file is damaged, the index, or the damaged segment, is
built again, with a note. Files are read and written while their folder is locked; where that is
impossible, the index is kept in memory.
"""

from __future__ import annotations

from contextlib import closing, suppress
from dataclasses import replace
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
from fpmatch.gallery.store.kept_files import FAULTS, INDEX, SEGMENT, kept_folders
from fpmatch.gallery.store.stored_template import unpack_template

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.store.gallery import Gallery
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
        self._digests = _NO_NUMBERS, _NO_NUMBERS
        self.stored = np.empty(0, np.intp)
        """The places, in all segments, of the prints that are in the gallery."""
        self.numbers = _NO_NUMBERS
        """The numbers of the entries of these prints, ascending."""

    @property
    def damaged(self) -> list[int]:
        """The numbers of the entries that are damaged."""
        damaged: list[int] = self._list.damaged.tolist()
        return damaged

    @property
    def segments(self) -> list[Segment]:
        """The segments of the index, as it followed the gallery last."""
        return [self._read[one.name] for one in self._list.segments]

    def follow(self, gallery: Gallery) -> None:
        """Let the index have all entries that are in the gallery now.

        If it has not changed, that takes one short query. Raises GalleryError where the gallery
        cannot be read.
        """
        if self._list.state == gallery.content_hash():
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

    def _update(self, gallery: Gallery, folder: IndexFolder, *, write: bool) -> None:
        """Take the index in a folder, mask what was removed since, and add what was enrolled."""
        state, (numbers, digests) = gallery.content_hash(), gallery.digests()
        self._digests = numbers, digests
        listed = self._with_segments_read(gallery, folder, self._known(folder, gallery), write)
        own, of_own = self._entries(listed)
        at = np.searchsorted(numbers, own)
        there = np.append(numbers, -1)[at] == own
        new = np.setdiff1d(numbers, np.append(own, listed.damaged))
        if (np.append(digests, 0)[at][there] != of_own[there]).any() or (new <= listed.last).any():
            self._say_built_again(f"files of the index of {gallery.name}", "other")
            listed, there, new = IndexList(), there[:0], numbers
        done, total = int(there.sum()), len(numbers)
        last, after = int(numbers[-1]) if total else 0, listed.last
        for segment, end in self._built(gallery, after, last, done, total):
            listed = self._with_segment(listed, segment)
            listed = replace(listed, state="", last=end)
            if write:
                self._write(listed, folder)
        known = np.append(listed.damaged, [k for k in gallery.damaged if after < k <= last])
        damaged = np.intersect1d(known, numbers).astype(np.int64)
        self._list = replace(listed, state=state, last=max(last, listed.last), damaged=damaged)
        self._read = {one.name: self._read[one.name] for one in listed.segments}
        own, _ = self._entries(self._list)
        self.stored = np.flatnonzero(np.isin(own, numbers))
        self.numbers = own[self.stored]
        if write and len(new):
            self._write(self._list, folder)

    def _entries(self, listed: IndexList) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return numbers and digests of the entries in the segments of a list."""
        read = [self._read[one.name] for one in listed.segments]
        numbers = np.concatenate([_NO_NUMBERS, *(segment.number for segment in read)])
        return numbers, np.concatenate([_NO_NUMBERS, *(segment.digest for segment in read)])

    def _known(self, folder: IndexFolder, gallery: Gallery) -> IndexList:
        """Return the newer list of that in a folder and that in memory."""
        listed = IndexList()
        try:
            listed = folder.read_list()
        except FpmatchError as error:
            if error.code != "missing":
                self._say_built_again(f"files of the index of {gallery.name}", error.code)
        return self._list if self._list.last > listed.last else listed

    def _with_segments_read(
        self, gallery: Gallery, folder: IndexFolder, listed: IndexList, write: bool
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
        self, gallery: Gallery, after: int, last: int, done: int = 0, total: int = 0
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
        self, gallery: Gallery, rows: Sequence[tuple[int, bytes]], done: int, total: int
    ) -> Segment | None:
        """Return a segment of those packed templates that are sound; None where none is."""
        enrolled, digests = self._digests
        at = np.searchsorted(enrolled, [number for number, _ in rows])
        of_rows = np.append(digests, -1)[at].tolist()
        given = [(*row, digest) for row, digest in zip(rows, of_rows, strict=True)]
        chunks = [given[k : k + PRINTS_PER_CHUNK] for k in range(0, len(rows), PRINTS_PER_CHUNK)]
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


def erase_removed(gallery: Gallery, numbers: Collection[int] | None = None) -> None:
    """Write the segments that have removed prints anew, in all folders.

    Only segments that may have entries of some `numbers` are read (default: all). An index that is
    damaged, or cannot be written, is deleted. Raises FpmatchError if a file cannot be.
    """
    enrolled, _ = gallery.digests()
    gone = None if numbers is None else np.array(sorted(numbers), np.int64)
    for path in kept_folders(gallery):
        files = [*path.glob(f"*{INDEX}"), *path.glob(f"*{SEGMENT}")]
        for name in sorted({one.name.partition(".")[0] for one in files}):
            folder = IndexFolder(path, name, gallery.sealing())
            with folder_lock(path):
                try:
                    listed = folder.read_list()
                    kept = tuple(_erased(folder, listed, enrolled, gone))
                    folder.write_list(replace(listed, state="", segments=kept))
                except FpmatchError:  # the next search makes it again
                    folder.delete()
                else:
                    folder.delete_others(kept, strict=True)


def _erased(
    folder: IndexFolder,
    listed: IndexList,
    enrolled: NDArray[np.int64],
    gone: NDArray[np.int64] | None,
) -> Iterator[Listed]:
    """Yield the segments of a list, those that had removed prints written without them."""
    for one in listed.segments:
        if gone is not None and not ((gone >= one.first) & (gone <= one.last)).any():
            yield one
            continue
        segment = folder.read_segment(one)
        left = np.flatnonzero(np.isin(segment.number, enrolled))
        if len(left) == len(segment):
            yield one
        elif len(left):
            segment = segment.take(left)
            written = Listed.of(segment)
            folder.write_segment(written, segment)
            yield written


def _build(
    matcher: Matcher, rows: Sequence[tuple[int, bytes, int]]
) -> tuple[Segment, dict[int, str]]:
    """Return a segment of those packed templates that are sound, and why others are not."""
    entries, prints, damaged = [], [], {}
    for number, data, digest in rows:
        try:
            prints.append(matcher.prepare(unpack_template(data)))
            entries.append((number, digest))
        except FpmatchError as error:
            damaged[number] = str(error)
    numbers, digests = zip(*entries, strict=True) if entries else ((), ())
    return Segment.build(numbers, digests, prints), damaged
