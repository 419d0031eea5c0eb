"""The index of a large gallery: it follows the database as entries are added and removed.

The database is the only truth. By its history (see `fpmatch.gallery.store.history`) the index finds
what was changed since it was written, by this program or any other; where that is not known, or a
file is damaged, the index, or the damaged segment, is built again, with a note. Files are written
while their folder is locked; where that is impossible, the index is kept in memory.
"""

from __future__ import annotations

from contextlib import closing, suppress
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.base.folders import make_folder
from fpmatch.base.output import reason
from fpmatch.errors import FpmatchError, GalleryError, OutputError
from fpmatch.gallery.engine.engine import processes, serial
from fpmatch.gallery.engine.folder_lock import folder_lock
from fpmatch.gallery.engine.in_threads import Threads
from fpmatch.gallery.engine.local import Serial
from fpmatch.gallery.engine.workers import no_progress
from fpmatch.gallery.index.files import IndexFolder
from fpmatch.gallery.index.print_segment import MOST_PRINTS, PrintSegment
from fpmatch.gallery.index.state import IndexState, Part, read_present, removals_between
from fpmatch.gallery.store.kept_files import FAULTS, kept_folders
from fpmatch.gallery.store.stored_template import unpack_template

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.store.history import Revision
    from fpmatch.gallery.store.reader import GalleryReader
    from fpmatch.matching.result import Matcher

PRINTS_PER_CHUNK: Final = 256
FEW: Final = 512  # prints that this process adds alone, or keeps in memory
MOST_ATTEMPTS: Final = 20  # to follow a gallery that others change all the time


class GalleryIndex:
    """Follow a gallery with an index of its prints, prepared by a matcher.

    `engine` prepares prints (default: all cores), `progress` is called with stage "prepare" and
    numbers of prints, and `note` with a line on what could not be used or written.
    """

    def __init__(
        self,
        gallery: GalleryReader,
        matcher: Matcher,
        *,
        engine: Engine | None = None,
        progress: Progress = no_progress,
        note: Callable[[str], object] = lambda _: None,
    ) -> None:
        self.gallery, self.matcher = gallery, matcher
        self._engine, self._progress, self._note = engine, progress, note
        self._threads = 1 if isinstance(engine, Serial) else None  # that check segments
        self._state: IndexState | None = None
        self._unwritable = False  # whether a note states it

    def refresh(self, *, full_segments: bool = False) -> IndexState:
        """Return the index of all entries that are in the gallery now.

        If it has not changed, that takes one short query. With `full_segments`, new entries that
        fill no segment are left to a later call. Raises GalleryError where the gallery cannot be
        read.
        """
        if self._state is not None and self._state.revision == self.gallery.revision():
            return self._state
        self.gallery.check_keys()
        in_memory = True
        for _ in range(MOST_ATTEMPTS):
            revision = self.gallery.revision()
            base = self._base(revision, in_memory=in_memory)
            if self.gallery.revision().removals != revision.removals:
                continue
            if base.base is None or base.base[0].removals != base.revision.removals:
                self._check_sums(revision)
            state: IndexState | None = base
            if base.revision.last < revision.last:
                state = self._extended(base, revision, full_segments=full_segments)
            elif base.base is None or base.base[0] != base.revision:
                state = self._written(base)
            if state is not None:
                break
            in_memory = False  # what is there does not fit what another program has written
        else:
            raise self.gallery.error("it is changed all the time", "index")
        self._state = self._reusing(state)
        for number in state.damaged.tolist():
            if number not in self.gallery.damaged:
                with suppress(GalleryError):
                    self.gallery.find_template(number)
        return self._state

    def _check_sums(self, now: Revision) -> None:
        """Check the sums of all entries, or near those that were removed since the last call."""
        before = self._state
        removals = None if before is None else removals_between(self.gallery, before.revision, now)
        if removals is None:
            self.gallery.check_sums()
        elif removals:
            self.gallery.check_sums(of=[one.entry for one in removals])

    def _reusing(self, state: IndexState) -> IndexState:
        """Return the index with segments that are read already for some that were rewritten."""
        before = self._state
        if before is None:
            return state
        removals = removals_between(self.gallery, before.revision, state.revision)
        return state if removals is None else state.reusing(before.after(removals, state.revision))

    def loaded(self) -> IndexState:
        """Return the index as it was refreshed last, all of its segments read and checked.

        Segments that are damaged are built again.
        """
        for _ in range(MOST_ATTEMPTS):
            state = self._state or self.refresh()
            with Threads(self._threads) as threads:
                faults = list(threads.map(_fault_of, None, state.parts))
            damaged = [one for one in zip(state.parts, faults, strict=True) if one[1]]
            if not damaged:
                self._state = state.exact()
                return self._state
            if all(fault == "missing" for _, fault in damaged) and self._replaced_by_another():
                continue
            self._say_built_again(f"segments of the index of {self.gallery.name}", damaged[0][1])
            for part, _ in damaged:
                state = self._rebuilt(part, state)
            self._state = self._written(state) or state
        raise self.gallery.error("its index cannot be read", "index")

    def _replaced_by_another(self) -> bool:
        """Return whether another program has replaced the segments; they are read then.

        The folder is locked meanwhile: a program that goes on removing entries could replace some
        segments while the others are read. Those that are read already are kept.
        """
        before, now = self._state, None
        if before is None or before.folder is None:
            return False
        with suppress(OSError, FpmatchError), folder_lock(before.folder.path):
            now = self._reusing(read_present(self.gallery, before.folder, before.parts))
            for part in now.parts:
                _fault_of(None, part)
        self._state = now
        if now is None or now.revision.last < before.revision.last:
            self._state = None
            now = self.refresh()
        names = {part.listed.name for part in now.parts}
        return names != {part.listed.name for part in before.parts}

    def _base(self, revision: Revision, *, in_memory: bool) -> IndexState:
        """Return the newest index there is, in memory or in a file, without what was removed."""
        known = () if self._state is None else self._state.parts
        states = [] if self._state is None or not in_memory else [self._state]
        faults: list[str] = []
        for folder in self._folders():
            try:
                states.append(IndexState.of_list(folder.read_list(), folder, known))
            except FpmatchError as error:
                if error.code != "missing":
                    faults.append(error.code)
        newest, listed = IndexState(revision=replace(revision, last=0)), None
        for state in states:
            before = state.revision
            removals = removals_between(self.gallery, before, revision)
            if removals is None:
                faults.append("other")
                continue
            listed = listed if state is self._state else state.base
            if before.last >= newest.revision.last:
                newest = state.after(removals, revision) if before != revision else state
        if listed is not None and newest.base != listed:
            newest = replace(newest, base=listed)
        if faults and newest.base is None and newest is not self._state:
            self._say_built_again(f"files of the index of {self.gallery.name}", faults[0])
        return newest

    def _extended(
        self, state: IndexState, revision: Revision, *, full_segments: bool
    ) -> IndexState | None:
        """Return an index with the entries that were added, up to a revision, as `_written`."""
        after = state.revision.last
        if full_segments and revision.last - after < MOST_PRINTS:
            return state
        self.gallery.check_whole(self._note, after=after)
        fingers = self.gallery.fingers(after=after)
        templates = self._templates(after, revision.last)
        done, total = 0, len(fingers)
        if total > FEW:
            self._progress("prepare", done, total)
        while True:
            some = list(islice(templates, MOST_PRINTS))
            if full_segments and len(some) < MOST_PRINTS:
                return state
            segment = self._built(some, fingers, done, total)
            done += len(some)
            last = some[-1][0] if len(some) == MOST_PRINTS else revision.last
            enrolled = {number for number in fingers if state.revision.last < number <= last}
            state = state.with_part(segment, last, enrolled.difference(segment.numbers.tolist()))
            written = self._written(state)
            if written is None or last == revision.last:
                return written
            state = written

    def _built(
        self,
        templates: Sequence[tuple[int, bytes]],
        fingers: dict[int, int],
        done: int = 0,
        total: int = 0,
    ) -> PrintSegment:
        """Return a segment of those packed templates that are sound."""
        rows = [(number, fingers.get(number, number), data) for number, data in templates]
        chunks = [rows[k : k + PRINTS_PER_CHUNK] for k in range(0, len(rows), PRINTS_PER_CHUNK)]
        engine = serial() if len(rows) <= FEW else self._engine or processes()
        parts: list[PrintSegment] = []
        damaged: dict[int, str] = {}
        with engine, closing(engine.map(_build, self.matcher, chunks)) as results:
            for part, failed in results:
                parts.append(part)
                damaged |= failed
                done += len(part) + len(failed)
                if total > FEW:
                    self._progress("prepare", min(done, total), total)
        self.gallery.damaged |= damaged
        return PrintSegment.concatenate(parts)

    def _rebuilt(self, part: Part, state: IndexState) -> IndexState:
        """Return the index with a segment that could not be read built again."""
        first, last = part.listed.first, min(part.listed.last, state.revision.last)
        self.gallery.check_whole(self._note, after=first - 1)
        known = set(state.damaged.tolist())
        rows = [row for row in self._templates(first - 1, last) if row[0] not in known]
        fingers = self.gallery.fingers(after=first - 1)
        segment = self._built(rows, fingers)
        known |= {n for n in fingers if n <= last}.difference(segment.numbers.tolist())
        return replace(state.replaced(part, segment), damaged=np.array(sorted(known), np.int64))

    def _templates(self, after: int, last: int) -> Iterator[tuple[int, bytes]]:
        for number, data in self.gallery.packed_templates(after=after):
            if number > last:
                return
            yield number, data

    def _written(self, state: IndexState) -> IndexState | None:
        """Return the index, in files where that is possible.

        None if another program has added the entries, too, or the history of the gallery was lost.
        A search that goes on waits for no other program to write a few prints: they stay in memory.
        """
        why = ""
        unwritten = sum(part.listed.prints for part in state.parts if part.folder is None)
        wait = self._state is None or unwritten > FEW
        for folder in self._folders() if state.folder is None else [state.folder]:
            try:
                make_folder(folder.path, narrow=True)
                with folder_lock(folder.path, wait=wait):
                    return self._write(state, folder)
            except BlockingIOError:
                return state
            except OutputError as error:
                why = why or error.detail or str(error)
            except FpmatchError:  # of a segment that cannot be read, which `loaded` finds
                return state
            except OSError as error:
                why = why or reason(error)
        if not self._unwritable:
            self._unwritable = True
            self._note(f"the index of {self.gallery.name} is kept in memory: {why}")
        return _merged(state)

    def _write(self, state: IndexState, folder: IndexFolder) -> IndexState | None:
        """Write an index to a folder that is locked.

        What another program has changed in the list meanwhile is kept.
        """
        now = self.gallery.revision()
        removals = removals_between(self.gallery, state.revision, now)
        if removals is None:
            return None
        if removals:
            state = state.after(removals, now)
        with suppress(FpmatchError):
            listed = folder.read_list()
            removals = removals_between(self.gallery, listed.revision, now)
            if removals is not None and not state.is_that_of(listed):
                present = IndexState.of_list(listed, folder, state.parts).after(removals, now)
                if (joined := present.with_newer(state)) is None:
                    return None
                state = joined
        written = _merged(state).write(folder)
        folder.delete_others([part.listed for part in written.parts])
        return written

    def _folders(self) -> list[IndexFolder]:
        sealing = self.gallery.sealing()
        return [
            IndexFolder(path, self.matcher.name, sealing) for path in kept_folders(self.gallery)
        ]

    def _say_built_again(self, what: str, fault: str) -> None:
        self._note(f"{what} {FAULTS.get(fault, FAULTS['damaged'])}: built again")


def _merged(state: IndexState) -> IndexState:
    """Return the index with few segments, if those to be merged are not damaged."""
    with suppress(FpmatchError):  # which the next search finds
        return state.merged()
    return state


def _fault_of(_: None, part: Part) -> str:
    """Return the code of the error with which a segment cannot be read; "" if it can be."""
    try:
        part.segment  # noqa: B018
    except FpmatchError as error:
        return error.code or "damaged"
    return ""


def _build(
    matcher: Matcher, rows: Sequence[tuple[int, int, bytes]]
) -> tuple[PrintSegment, dict[int, str]]:
    """Return a segment of entries, with their fingers, and why others cannot be in one."""
    sound, damaged = [], {}
    for number, finger, data in rows:
        try:
            template = unpack_template(data)
            sound.append((number, finger, template, matcher.prepare(template)))
        except FpmatchError as error:
            damaged[number] = str(error)
    return PrintSegment.build(sound), damaged
