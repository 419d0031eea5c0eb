"""The index of a large gallery: it follows the database as entries are added and removed.

The database is the only truth. Where its state has changed, by this program or any other, the
numbers and digests of its entries are listed; what is new is added to the index, what was removed
is masked, and what changed is written. An index is the segments in a folder, which never change.
A print may be in several of them, where a process was killed between writing a segment and deleting
those that it replaces: it counts once, and a segment without a print that counts is deleted. Files
are read and written while their folder is locked; those that are damaged are made again, with a
note.
"""

from __future__ import annotations

import re
import secrets
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.base.folders import make_folder, remove_unfinished
from fpmatch.base.output import reason
from fpmatch.errors import FpmatchError, OutputError
from fpmatch.gallery.engine.engine import make_engine, serial
from fpmatch.gallery.engine.folder_lock import folder_lock
from fpmatch.gallery.engine.workers import no_progress
from fpmatch.gallery.index.segment import COLUMNS, MOST_PRINTS, Segment, parameters
from fpmatch.gallery.store.array_file import read_arrays, write_arrays
from fpmatch.gallery.store.kept_files import FAULTS, SEGMENT, STALE_S, kept_folders
from fpmatch.gallery.store.stored_template import unpack_template

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.store.gallery import Gallery
    from fpmatch.gallery.store.sealing import Sealing
    from fpmatch.matching.result import Matcher

    Counted = tuple[Segment, NDArray[np.bool_]]  # a segment, and which of its prints count
    Entries = tuple[NDArray[np.int64], NDArray[np.int64]]  # ascending numbers, and digests

PRINTS_PER_CHUNK: Final = 256
FEW: Final = 512  # prints that this process adds alone
_SPAN: Final = re.compile(r"[^.]+\.(\d+)-(\d+)\.[0-9a-f]+")
"""In the name of a file: the least and the greatest number of an entry of a segment."""


class GalleryIndex:
    """Follow a gallery with an index of its prints, prepared by a matcher.

    `engine` prepares prints (default: all cores), `progress` is called with stage "prepare" and
    numbers of prints, and `note` with a line on what could not be used or written. A search adds up
    the `segments`, of which the prints at the places `stored` are in the gallery: entries of the
    `numbers`, ascending. Entries that are `damaged` are not in the index.
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
        self._held: dict[str, Counted] = {}  # by the names of their files
        self.segments: list[Segment] = []
        self.stored = np.empty(0, np.intp)
        self.numbers = np.empty(0, np.int64)
        self.damaged: list[int] = []

    def follow(self, gallery: Gallery) -> None:
        """Let the index have all entries that are in the gallery now.

        Raises GalleryError where the gallery cannot be read.
        """
        why = place = ""
        for path in kept_folders(gallery):
            try:
                make_folder(path, narrow=True)
                with folder_lock(path):
                    self._update(gallery, IndexFolder(path, self.matcher.name, gallery.sealing()))
                place = str(path)
                break
            except OutputError as error:
                why = why or error.detail or str(error)
            except OSError as error:
                why = why or reason(error)
        else:
            self._update(gallery, None)
        if why and not self._noted:
            self._note(f"the index of {gallery.name} is kept in {place or 'memory'}: {why}")
            self._noted = True

    def _update(self, gallery: Gallery, folder: IndexFolder | None) -> None:
        """List what is enrolled, add what is new, mask what is gone, and write what changed."""
        numbers, digests = gallery.digests()
        named = {name: one for name, (one, _) in self._held.items()}
        if folder is not None:  # where files could not be written, segments are in memory alone
            named = self._read(folder, gallery.name) | named
        self._held, there = _counted(named, numbers, digests)
        new = numbers[~there]
        with serial() if len(new) <= FEW else self._engine or make_engine() as engine:
            for first in range(0, max(len(new), 1), MOST_PRINTS):
                some = new[first : first + MOST_PRINTS]
                given = digests[np.searchsorted(numbers, some)]
                made = self._built(gallery, engine, some, given, first, len(new))
                if len(made):
                    self._held = _with_segment(self._held, made)
                if folder is not None:
                    folder.write(self._held)
        self.segments = [one for one, _ in self._held.values()]
        counts = [np.empty(0, bool), *(mask for _, mask in self._held.values())]
        every = np.concatenate([numbers[:0], *(one.number for one in self.segments)])
        stored = np.flatnonzero(np.concatenate(counts))
        self.stored = stored[np.argsort(every[stored])]
        self.numbers = every[self.stored]
        self.damaged = np.setdiff1d(numbers, self.numbers).tolist()

    def _read(self, folder: IndexFolder, name: str) -> dict[str, Segment]:
        """Return the segments in a folder that are whole."""
        segments: dict[str, Segment] = {}
        faults = set[str]()
        for file in folder.names():
            try:
                segments[file] = self._held[file][0] if file in self._held else folder.read(file)
            except FpmatchError as error:
                faults.add(FAULTS.get(error.code, FAULTS["damaged"]))
        for fault in sorted(faults):
            self._note(f"files of the index of {name} {fault}: built again")
        return segments

    def _built(
        self,
        gallery: Gallery,
        engine: Engine,
        numbers: NDArray[np.int64],
        digests: NDArray[np.int64],
        done: int,
        total: int,
    ) -> Segment:
        """Return a segment of those entries that are sound."""
        rows = dict(gallery.packed_templates(of=numbers.tolist()))
        of_number = zip(numbers.tolist(), digests.tolist(), strict=True)
        given = [(number, rows[number], digest) for number, digest in of_number if number in rows]
        chunks = [given[k : k + PRINTS_PER_CHUNK] for k in range(0, len(given), PRINTS_PER_CHUNK)]
        parts = [Segment.build([], [], [])]
        with closing(engine.map(_build, self.matcher, chunks)) as results:
            for chunk, (part, failed) in zip(chunks, results, strict=True):
                gallery.damaged |= failed
                parts.append(part)
                done += len(chunk)
                if total > FEW:
                    self._progress("prepare", min(done, total), total)
        return Segment.joined([(part, np.ones(len(part), bool)) for part in parts])


def _build(
    matcher: Matcher, rows: Sequence[tuple[int, bytes, int]]
) -> tuple[Segment, dict[int, str]]:
    """Return a segment of those packed templates that are sound, and why others are not."""
    sound, prints, damaged = [], [], {}
    for number, data, digest in rows:
        try:
            prints.append(matcher.prepare(unpack_template(data)))
            sound.append((number, digest))
        except FpmatchError as error:
            damaged[number] = str(error)
    return Segment.build([n for n, _ in sound], [digest for _, digest in sound], prints), damaged


def _enrolled(
    segment: Segment, numbers: NDArray[np.int64], digests: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Return which prints of a segment are enrolled, and their places among the entries.

    Entries have ascending numbers; a print is enrolled if one has its number and its digest.
    """
    at = np.searchsorted(numbers, segment.number)
    same = np.append(numbers, -1)[at] == segment.number
    return same & (np.append(digests, 0)[at] == segment.digest), at


def _counted(
    named: dict[str, Segment], numbers: NDArray[np.int64], digests: NDArray[np.int64]
) -> tuple[dict[str, Counted], NDArray[np.bool_]]:
    """Return the segments in which enrolled prints count, by their entries, and which of all do."""
    there = np.zeros(len(numbers) + 1, bool)
    enrolled = {name: _enrolled(one, numbers, digests) for name, one in named.items()}

    def removed_last(name: str) -> tuple[int, int]:
        return -int(np.count_nonzero(enrolled[name][0])), len(named[name])

    counted: dict[str, Counted] = {}
    for name in sorted(named, key=removed_last):
        is_enrolled, at = enrolled[name]
        counts = is_enrolled & ~there[at]
        there[at[counts]] = True
        if counts.any():
            counted[name] = named[name], counts
    return dict(sorted(counted.items(), key=lambda item: int(item[1][0].number[0]))), there[:-1]


def _with_segment(held: dict[str, Counted], segment: Segment) -> dict[str, Counted]:
    """Return segments and another one, merged with those before that are not much larger.

    So a print is copied a few times only where prints are added one by one.
    """
    left = [*held.items()]
    counts = np.ones(len(segment), bool)
    while left:
        _, before = left[-1]
        size = np.count_nonzero(before[1])
        if size > max(2 * len(segment), 1) or size + len(segment) > MOST_PRINTS:
            break
        segment = Segment.joined([before, (segment, counts)])
        counts = np.ones(len(segment), bool)
        left.pop()
    return dict(left) | {_new_name(segment): (segment, counts)}


def _new_name(segment: Segment) -> str:
    return f"{segment.number.min()}-{segment.number.max()}.{secrets.token_hex(8)}"


@dataclass(frozen=True, slots=True)
class IndexFolder:
    """Read and write the segments of the index of a gallery, for a matcher, in one folder."""

    path: Path
    matcher: str
    sealing: Sealing | None = None

    def names(self) -> list[str]:
        """Return the names of the segments."""
        of_matcher = len(self.matcher) + 1
        return [one.stem[of_matcher:] for one in self.path.glob(f"{self.matcher}.*{SEGMENT}")]

    def read(self, name: str) -> Segment:
        """Return a segment, mapped; raise FpmatchError with the codes of `read_arrays`."""
        unseal = None if self.sealing is None else self.sealing.unseal_file
        path = self._path(name)
        return Segment.of_arrays(read_arrays(path, COLUMNS, self._about(name), unseal=unseal))

    def write(self, held: dict[str, Counted]) -> None:
        """Write segments that are in no file, and map them; then delete all other files.

        Raises OutputError if a segment cannot be written.
        """
        for name, (segment, counts) in held.items():
            if not self._path(name).exists():
                self.write_segment(name, segment)
                held[name] = self.read(name), counts
        kept = {self._path(name) for name in held}
        with suppress(OSError):
            remove_unfinished(self.path, older_than_s=STALE_S)
            for path in {*self.path.glob(f"{self.matcher}.*")} - kept:
                path.unlink(missing_ok=True)

    def write_segment(self, name: str, segment: Segment) -> None:
        """Write a segment; raise OutputError if that is impossible."""
        seal = None if self.sealing is None else self.sealing.seal_file
        write_arrays(self._path(name), segment.arrays(), COLUMNS, self._about(name), seal=seal)

    def _path(self, name: str) -> Path:
        return self.path / f"{self.matcher}.{name}{SEGMENT}"

    def _about(self, name: str) -> dict[str, str]:
        return {"name": name, "index": parameters(), "version": __version__}


def erase_removed(gallery: Gallery, numbers: Collection[int] | None = None) -> None:
    """Write the segments that have removed prints anew, in all folders.

    Only segments that may have entries of some `numbers` are read (default: all). One that is
    damaged, or cannot be written anew, is deleted. Raises FpmatchError if a file cannot be.
    """
    enrolled = gallery.digests()
    gone = None if numbers is None else np.array([*numbers], np.int64)
    for path in filter(Path.is_dir, kept_folders(gallery)):
        with folder_lock(path):
            for file in sorted(path.glob(f"*{SEGMENT}")):
                span = _SPAN.fullmatch(file.stem)
                if span is not None and gone is not None:
                    first, last = map(int, span.groups())
                    if not ((gone >= first) & (gone <= last)).any():
                        continue
                matcher, _, name = file.stem.partition(".")
                folder = IndexFolder(path, matcher, gallery.sealing())
                with suppress(FpmatchError):  # the next search makes it again
                    segment = folder.read(name)
                    left, _ = _enrolled(segment, *enrolled)
                    if left.all():
                        continue
                    if left.any():
                        anew = Segment.joined([(segment, left)])
                        folder.write_segment(_new_name(anew), anew)
                try:
                    file.unlink(missing_ok=True)
                except OSError as error:
                    why = f"cannot be deleted: {reason(error)}"
                    raise FpmatchError(f"{file.name}: {why}") from error
