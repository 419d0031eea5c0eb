"""The index of a large gallery: it follows the database as entries are added and removed.

The database is the only truth. Where its state has changed, by this program or any other, the
numbers and digests of its entries are listed; what is new is added to the index, what was removed
is masked, and what changed is written. An index is a list of segments, which never change, in a
folder. A killed process leaves the list of before or the one of after; segments that are not on it
are deleted by the next one that writes. Files are read and written while their folder is locked;
those that are damaged are made again, with a note.
"""

from __future__ import annotations

import secrets
from contextlib import closing, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fpmatch._version import __version__
from fpmatch.base.folders import make_folder, remove_unfinished
from fpmatch.base.output import reason
from fpmatch.errors import FpmatchError, GalleryError, OutputError
from fpmatch.gallery.engine.engine import processes, serial
from fpmatch.gallery.engine.folder_lock import folder_lock
from fpmatch.gallery.engine.workers import no_progress
from fpmatch.gallery.index.segment import COLUMNS, MOST_PRINTS, Segment, parameters
from fpmatch.gallery.store.array_file import Column, read_arrays, write_arrays
from fpmatch.gallery.store.kept_files import FAULTS, INDEX, SEGMENT, STALE_S, kept_folders
from fpmatch.gallery.store.stored_template import unpack_template

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.store.gallery import Gallery
    from fpmatch.gallery.store.sealing import Sealing
    from fpmatch.matching.result import Matcher

    Segments = dict[str, Segment]  # by the names of their files

PRINTS_PER_CHUNK: Final = 256
FEW: Final = 512  # prints that this process adds alone
NAME_BYTES: Final = 8
LIST_COLUMNS: Final = {
    "name": Column("|u1", ("segment", NAME_BYTES)),
    "span": Column("<i8", ("segment", 2)),  # the least and the greatest number of an entry
    "damaged": Column("<i8", ("damaged",)),
}
_NO_NUMBERS: Final = np.empty(0, np.int64)


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
        self._state = ""
        self._segments: Segments = {}
        self._damaged = _NO_NUMBERS
        self.stored = np.empty(0, np.intp)
        """The places, in all segments, of the prints that are in the gallery."""
        self.numbers = _NO_NUMBERS
        """The numbers of the entries of these prints."""

    @property
    def damaged(self) -> list[int]:
        """The numbers of the entries that are damaged."""
        damaged: list[int] = self._damaged.tolist()
        return damaged

    @property
    def segments(self) -> list[Segment]:
        """The segments of the index, as it followed the gallery last."""
        return [*self._segments.values()]

    def follow(self, gallery: Gallery) -> None:
        """Let the index have all entries that are in the gallery now.

        If it has not changed, that takes one short query. Raises GalleryError where the gallery
        cannot be read.
        """
        state = gallery.content_hash()
        if self._state == state:
            return
        gallery.check_keys()
        why = ""
        for path in kept_folders(gallery):
            folder = IndexFolder(path, self.matcher.name, gallery.sealing())
            try:
                make_folder(path, narrow=True)
                with folder_lock(path):
                    self._update(gallery, folder)
                if why:
                    self._say_once(f"the index of {gallery.name} is kept in {path}: {why}")
                break
            except OutputError as error:
                why = why or error.detail or str(error)
            except OSError as error:
                why = why or reason(error)
        else:
            self._update(gallery, None)
            self._say_once(f"the index of {gallery.name} is kept in memory: {why}")
        self._state = state
        for number in self.damaged:
            if number not in gallery.damaged:
                with suppress(GalleryError):
                    gallery.find_template(number)

    def _say_once(self, text: str) -> None:
        if not self._noted:
            self._note(text)
        self._noted = True

    def _update(self, gallery: Gallery, folder: IndexFolder | None) -> None:
        """List what is enrolled, add what is new, mask what is gone, and write what changed."""
        numbers, digests = gallery.digests()
        before, segments, damaged = self._segments, self._segments, self._damaged
        if folder is not None:
            segments, damaged = self._kept(folder, gallery.name)
        kept = {k: one for k, one in segments.items() if _enrolled(one, numbers, digests).any()}
        changed = len(kept) < len(segments)
        segments, damaged = kept, np.intersect1d(damaged, numbers)
        indexed = [one.number[_enrolled(one, numbers, digests)] for one in segments.values()]
        new = np.setdiff1d(numbers, np.concatenate([damaged, *indexed]))
        for one in before.values():  # what only this process has, where it could not be written
            lacks = np.isin(one.number, new) & _enrolled(one, numbers, digests)
            if lacks.any():
                segments = _with_segment(segments, one.take(np.flatnonzero(lacks)))
                new, changed = np.setdiff1d(new, one.number[lacks]), True
        for first in range(0, len(new), MOST_PRINTS):
            some = new[first : first + MOST_PRINTS]
            given = digests[np.searchsorted(numbers, some)]
            made = self._built(gallery, some, given, first, len(new))
            if made is not None:
                segments = _with_segment(segments, made)
            damaged = np.union1d(damaged, some if made is None else np.setdiff1d(some, made.number))
            self._segments = segments
            if folder is not None:
                folder.write(segments, damaged)
            changed = False
        if changed and folder is not None:
            folder.write(segments, damaged)
        self._segments, self._damaged = segments, damaged
        every = [_NO_NUMBERS, *(one.number for one in segments.values())]
        there = [np.empty(0, bool), *(_enrolled(one, numbers, digests) for one in self.segments)]
        self.stored = np.flatnonzero(np.concatenate(there))
        self.numbers = np.concatenate(every)[self.stored]

    def _kept(self, folder: IndexFolder, name: str) -> tuple[Segments, NDArray[np.int64]]:
        """Return the segments in a folder, those that are whole, and the damaged entries."""
        segments: Segments = {}
        try:
            listed, damaged = folder.read_list()
        except FpmatchError as error:
            if error.code != "missing":
                fault = FAULTS.get(error.code, FAULTS["damaged"])
                self._note(f"files of the index of {name} {fault}: built again")
            return segments, _NO_NUMBERS
        for one in listed:
            try:
                segments[one] = self._segments.get(one) or folder.read_segment(one)
            except FpmatchError as error:
                fault = FAULTS.get(error.code, FAULTS["damaged"])
                self._note(f"segments of the index of {name} {fault}: built again")
        return segments, damaged

    def _built(
        self,
        gallery: Gallery,
        numbers: NDArray[np.int64],
        digests: NDArray[np.int64],
        done: int,
        total: int,
    ) -> Segment | None:
        """Return a segment of those entries that are sound; None where none is."""
        rows = dict(gallery.packed_templates(of=numbers.tolist()))
        of_number = zip(numbers.tolist(), digests.tolist(), strict=True)
        given = [(number, rows[number], digest) for number, digest in of_number if number in rows]
        chunks = [given[k : k + PRINTS_PER_CHUNK] for k in range(0, len(given), PRINTS_PER_CHUNK)]
        engine = serial() if len(given) <= FEW else self._engine or processes()
        parts: list[Segment] = []
        with engine, closing(engine.map(_build, self.matcher, chunks)) as results:
            for chunk, (part, failed) in zip(chunks, results, strict=True):
                gallery.damaged |= failed
                parts += [part] if len(part) else []
                done += len(chunk)
                if len(given) > FEW:
                    self._progress("prepare", min(done, total), total)
        return Segment.concatenate(parts) if parts else None


def _enrolled(
    segment: Segment, numbers: NDArray[np.int64], digests: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return which prints of a segment a gallery still has, by entry and digest; numbers ascend."""
    at = np.searchsorted(numbers, segment.number)
    there = np.append(numbers, -1)[at] == segment.number
    return np.asarray(there & (np.append(digests, 0)[at] == segment.digest))


def _with_segment(segments: Segments, segment: Segment) -> Segments:
    """Return segments and another one, merged with those before that are not much larger.

    So a print is copied a few times only where prints are added one by one.
    """
    left = [*segments.items()]
    while left:
        _, before = left[-1]
        size = len(before) + len(segment)
        if len(before) > max(2 * len(segment), 1) or size > MOST_PRINTS:
            break
        segment = Segment.concatenate([before, segment])
        left.pop()
    return dict(left) | {secrets.token_hex(NAME_BYTES): segment}


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


@dataclass(frozen=True, slots=True)
class IndexFolder:
    """Read and write the files of the index of a gallery, for a matcher, in one folder."""

    path: Path
    matcher: str
    sealing: Sealing | None = None

    def read_list(self) -> tuple[dict[str, tuple[int, int]], NDArray[np.int64]]:
        """Return the spans of segments by their names, and the numbers of damaged entries.

        Raises FpmatchError with the codes of `read_arrays`.
        """
        arrays = self._read(self._list, LIST_COLUMNS)
        names = [name.tobytes().hex() for name in arrays["name"]]
        spans = [(first, last) for first, last in arrays["span"].tolist()]
        return dict(zip(names, spans, strict=True)), arrays["damaged"]

    def read_segment(self, name: str) -> Segment:
        """Return a segment, mapped; raise FpmatchError with the codes of `read_arrays`."""
        path = self._segment(name)
        try:
            return Segment.of_arrays(self._read(path, COLUMNS))
        except FpmatchError as error:
            raise FpmatchError(error.detail, path=path, code=error.code or "damaged") from error

    def write(self, segments: Segments, damaged: NDArray[np.int64]) -> None:
        """Write segments that are in no file, and map them, then replace the list.

        Raises OutputError if that is impossible.
        """
        for name, segment in segments.items():
            if not self._segment(name).exists():
                self.write_segment(name, segment)
                segments[name] = self.read_segment(name)
        self.write_list({name: _span(one) for name, one in segments.items()}, damaged)

    def write_segment(self, name: str, segment: Segment) -> tuple[int, int]:
        """Write a segment and return its span; raise OutputError if that is impossible."""
        self._write(self._segment(name), segment.arrays(), COLUMNS)
        return _span(segment)

    def write_list(
        self, spans: dict[str, tuple[int, int]], damaged: NDArray[np.int64], *, strict: bool = False
    ) -> None:
        """Replace the list, and delete segments that are not on it, and old unfinished files.

        Raises OutputError if the list cannot be written; with `strict`, FpmatchError if a segment
        cannot be deleted.
        """
        names = np.array([list(bytes.fromhex(name)) for name in spans], np.uint8)
        arrays: dict[str, NDArray[Any]] = {
            "name": names.reshape(-1, NAME_BYTES),
            "span": np.array([*spans.values()], np.int64).reshape(-1, 2),
            "damaged": damaged,
        }
        self._write(self._list, arrays, LIST_COLUMNS)
        with suppress(OSError):
            remove_unfinished(self.path, older_than_s=STALE_S)
        self.delete({self._segment(name) for name in spans} | {self._list}, strict=strict)

    def delete(self, kept: Collection[Path] = (), *, strict: bool = True) -> None:
        """Delete the files of the index but those that are kept.

        With `strict`, raise FpmatchError if one cannot be deleted.
        """
        for path in {self._list, *self.path.glob(self._segment("*").name)}.difference(kept):
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                if strict:
                    why = f"cannot be deleted: {reason(error)}"
                    raise FpmatchError(f"{path.name}: {why}") from error

    @property
    def _list(self) -> Path:
        return self.path / f"{self.matcher}{INDEX}"

    def _segment(self, name: str) -> Path:
        return self.path / f"{self.matcher}.{name}{SEGMENT}"

    def _about(self, path: Path) -> dict[str, str]:
        return {"name": path.name, "index": parameters(), "version": __version__}

    def _write(
        self, path: Path, arrays: dict[str, NDArray[Any]], columns: dict[str, Column]
    ) -> None:
        seal = None if self.sealing is None else self.sealing.seal_file
        write_arrays(path, arrays, columns, self._about(path), seal=seal)

    def _read(self, path: Path, columns: dict[str, Column]) -> dict[str, NDArray[Any]]:
        unseal = None if self.sealing is None else self.sealing.unseal_file
        return read_arrays(path, columns, self._about(path), unseal=unseal)


def _span(segment: Segment) -> tuple[int, int]:
    return int(segment.number.min()), int(segment.number.max())


def erase_removed(gallery: Gallery, numbers: Collection[int] | None = None) -> None:
    """Write the segments that have removed prints anew, in all folders.

    Only segments that may have entries of some `numbers` are read (default: all). An index that is
    damaged, or cannot be written, is deleted. Raises FpmatchError if a file cannot be.
    """
    enrolled, digests = gallery.digests()
    gone = None if numbers is None else np.array(sorted(numbers), np.int64)
    for path in kept_folders(gallery):
        files = [*path.glob(f"*{INDEX}"), *path.glob(f"*{SEGMENT}")]
        for name in sorted({one.name.partition(".")[0] for one in files}):
            folder = IndexFolder(path, name, gallery.sealing())
            with folder_lock(path):
                try:
                    spans, damaged = folder.read_list()
                    kept: dict[str, tuple[int, int]] = {}
                    for one, (first, last) in spans.items():
                        if gone is not None and not ((gone >= first) & (gone <= last)).any():
                            kept[one] = first, last
                            continue
                        segment = folder.read_segment(one)
                        left = np.flatnonzero(_enrolled(segment, enrolled, digests))
                        if len(left) == len(segment):
                            kept[one] = first, last
                        elif len(left):
                            written = secrets.token_hex(NAME_BYTES)
                            kept[written] = folder.write_segment(written, segment.take(left))
                    folder.write_list(kept, np.intersect1d(damaged, enrolled), strict=True)
                except FpmatchError:  # the next search makes it again
                    folder.delete()
