"""The index of a gallery at one moment: segments, and what of them was removed since."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.errors import FpmatchError
from fpmatch.gallery.index.files import IndexList, listed_as
from fpmatch.gallery.index.print_segment import MOST_PRINTS, PrintSegment
from fpmatch.gallery.store.history import UNKNOWN, Revision

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.index.files import IndexFolder, Listed
    from fpmatch.gallery.store.history import Removal
    from fpmatch.gallery.store.reader import GalleryReader

MOST_OF_A_SIZE: Final = 4  # segments of about one size; they are merged then
NOTHING: Final = Revision("", 0, 0)
"""Revision of an index without prints."""
KEPT_IN_MEMORY: Final = 1024  # prints of a segment that is not mapped once it was written
READ_AGAIN: Final = 8  # segments that a search reads again each time that the gallery has changed


class Part:
    """A segment in memory, or in a file, which is read when the segment is used first."""

    def __init__(
        self, listed: Listed, folder: IndexFolder | None, segment: PrintSegment | None = None
    ) -> None:
        self.listed, self.folder, self._segment = listed, folder, segment

    @classmethod
    def of(cls, segment: PrintSegment) -> Part:
        """Return a segment that is in no file."""
        return cls(listed_as(segment), None, segment)

    @property
    def segment(self) -> PrintSegment:
        """The segment; FpmatchError, with the codes of `read_arrays`, if it cannot be read."""
        if self._segment is None:
            assert self.folder is not None
            self._segment = self.folder.read_segment(self.listed)
        return self._segment

    @property
    def is_read(self) -> bool:
        """Whether the segment is in memory or mapped."""
        return self._segment is not None

    def among(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the ascending numbers that are in the range of the segment."""
        first, last = np.searchsorted(numbers, [self.listed.first, self.listed.last + 1])
        return numbers[first:last]

    def may_contain(self, numbers: NDArray[np.int64]) -> bool:
        """Return whether any of ascending numbers is within the range of the segment's."""
        return bool(len(self.among(numbers)))

    def without(self, removed: NDArray[np.int64]) -> PrintSegment:
        """Return the segment without prints of some ascending numbers."""
        segment = self.segment
        left = np.flatnonzero(~np.isin(segment.numbers, removed))
        return segment if len(left) == len(segment) else segment.take(left)


@dataclass(frozen=True, eq=False)
class IndexState:
    """An index, as `fpmatch.gallery.index.files.IndexList` describes it, and its segments.

    The ranges of the numbers of the parts ascend and do not overlap. `folder` is where the list is,
    if it is in a file, and `base` its revision and segments when it was read or written last.
    """

    revision: Revision = NOTHING
    parts: tuple[Part, ...] = ()
    removed: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    renumbered: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), np.int64))
    damaged: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    folder: IndexFolder | None = None
    base: tuple[Revision, tuple[Listed, ...]] | None = None

    @classmethod
    def of_list(
        cls, listed: IndexList, folder: IndexFolder, known: Iterable[Part] = ()
    ) -> IndexState:
        """Return the index of a list; segments that are `known` are not read again."""
        read = {part.listed: part for part in known if part.folder is not None}
        parts = tuple(read.get(one) or Part(one, folder) for one in listed.segments)
        rest = listed.removed, listed.renumbered, listed.damaged, folder
        return cls(listed.revision, parts, *rest, base=(listed.revision, listed.segments))

    def is_that_of(self, listed: IndexList) -> bool:
        """Return whether the list has not changed since, and no rewritten segment is still used."""
        of_files = {part.listed for part in self.parts if part.folder is not None}
        return self.base == (listed.revision, listed.segments) and of_files <= {*listed.segments}

    def write(self, folder: IndexFolder) -> IndexState:
        """Write the list, and the segments that are in no file, to a folder; return the index.

        No print that was removed is in what is written. Small segments stay in memory, others are
        mapped when they are used. Raises OutputError.
        """
        state, there = self, folder.names()
        new = [part for part in self.parts if part.listed.name not in there]
        for part in new:
            if part.may_contain(state.removed):
                state = state.erased(part, part.without(state.removed))
        parts = []
        for part in state.parts:
            if part.listed.name not in there:
                listed = folder.write_segment(part.segment)
                kept = part.segment if listed.prints <= KEPT_IN_MEMORY else None
                parts.append(Part(listed, folder, kept))
            else:
                parts.append(part)
        segments = tuple(part.listed for part in parts)
        rest = state.removed, state.renumbered, state.damaged
        folder.write_list(IndexList(state.revision, segments, *rest))
        return replace(state, parts=tuple(parts), folder=folder, base=(state.revision, segments))

    def __len__(self) -> int:
        return sum(part.listed.prints for part in self.parts) - len(self.removed)

    @property
    def segments(self) -> list[PrintSegment]:
        """The segments; FpmatchError if one cannot be read."""
        return [part.segment for part in self.parts]

    def after(self, removals: Sequence[Removal], revision: Revision) -> IndexState:
        """Return the index after some removals; entries added since are not in it."""
        entries = np.unique(np.array([one.entry for one in removals], np.int64))
        entries = entries[entries <= self.revision.last]
        damaged = np.setdiff1d(self.damaged, entries)
        in_parts = np.setdiff1d(entries, self.damaged)
        first_gone = [
            (one.entry, one.finger)
            for one in removals
            if one.finger is not None and one.entry < one.finger
        ]
        renumbered = np.array(first_gone, np.int64).reshape(-1, 2)
        return replace(
            self,
            revision=replace(revision, last=min(self.revision.last, revision.last)),
            removed=np.union1d(self.removed, in_parts),
            renumbered=np.concatenate([self.renumbered, renumbered]),
            damaged=damaged,
        )

    def with_part(self, segment: PrintSegment, last: int, damaged: Iterable[int]) -> IndexState:
        """Return the index with the entries of numbers up to `last`."""
        added = (Part.of(segment),) if len(segment) else ()
        return replace(
            self,
            revision=replace(self.revision, last=last),
            parts=(*self.parts, *added),
            damaged=np.union1d(self.damaged, np.array([*damaged], np.int64)),
        )

    def with_newer(self, other: IndexState) -> IndexState | None:
        """Return the index with the entries of another one that are newer than all of this one.

        None if this one has newer entries, or the other one has merged newer with older ones.
        """
        last = self.revision.last
        parts = [part for part in other.parts if part.listed.last > last]
        if other.revision.last < last or any(part.listed.first <= last for part in parts):
            return None
        return replace(
            self,
            revision=replace(self.revision, last=other.revision.last),
            parts=(*self.parts, *parts),
            removed=np.append(self.removed, other.removed[other.removed > last]),
            renumbered=np.unique(np.concatenate([self.renumbered, other.renumbered]), axis=0),
            damaged=np.append(self.damaged, other.damaged[other.damaged > last]),
        )

    def reusing(self, before: IndexState) -> IndexState:
        """Return the index with segments of one `before` for most of those that were rewritten.

        Those before are read already; what was removed from them since is left out. The few that
        have lost the most are read again. `before` lacks all prints that this index lacks.
        """
        known = [part for part in before.parts if part.is_read]
        firsts = [part.listed.first for part in known]
        reused: list[tuple[int, Part, NDArray[np.int64]]] = []
        for place, part in enumerate(self.parts):
            old = known[at - 1] if (at := bisect_right(firsts, part.listed.first)) else None
            if old is None or part.is_read or part.listed.last > old.listed.last:
                continue
            gone = old.among(before.removed)
            left = part.listed.prints - len(part.among(self.removed))
            if old.listed.prints - len(gone) == left:  # the same prints
                reused.append((place, old, gone))
        parts, removed = list(self.parts), [self.removed]
        for place, old, gone in sorted(reused, key=lambda one: len(one[2]))[:-READ_AGAIN]:
            parts[place] = old
            removed.append(gone)
        return replace(self, parts=tuple(parts), removed=np.unique(np.concatenate(removed)))

    def replaced(self, old: Part, new: PrintSegment) -> IndexState:
        """Return the index with another segment, or none, in the place of one."""
        place = self.parts.index(old)
        added = (Part.of(new),) if len(new) else ()
        return replace(self, parts=(*self.parts[:place], *added, *self.parts[place + 1 :]))

    def erased(self, old: Part, new: PrintSegment) -> IndexState:
        """Return the index with a segment, without removed prints, in the place of one."""
        first, end = np.searchsorted(self.removed, [old.listed.first, old.listed.last + 1])
        since = np.intersect1d(self.removed[first:end], new.numbers)  # removed since it was made
        removed = np.concatenate([self.removed[:first], since, self.removed[end:]])
        return replace(self.replaced(old, new), removed=removed)

    def exact(self) -> IndexState:
        """Return the index with no number among the removed ones that is in no segment."""
        of_parts = [part.segment.numbers for part in self.parts if part.may_contain(self.removed)]
        there = [self.removed[np.isin(self.removed, numbers)] for numbers in of_parts]
        removed = np.concatenate([np.empty(0, np.int64), *there])
        return self if len(removed) == len(self.removed) else replace(self, removed=removed)

    def merged(self) -> IndexState:
        """Return the index with the last segments merged where there are many of about one size.

        A print is copied once for each size, so that adding prints one by one costs little.
        """
        parts = list(self.parts)
        size = 1
        while (size := MOST_OF_A_SIZE * size) < MOST_PRINTS:
            first, total = len(parts), 0
            while first and parts[first - 1].listed.prints < size:
                first -= 1
            end = first
            while end < len(parts) and total + parts[end].listed.prints <= MOST_PRINTS:
                total += parts[end].listed.prints
                end += 1
            if end - first >= MOST_OF_A_SIZE:
                whole = PrintSegment.concatenate(
                    [p.without(self.removed) for p in parts[first:end]]
                )
                parts[first:end] = [Part.of(whole)] if len(whole) else []
        return replace(self, parts=tuple(parts), removed=self._removed_from(parts))

    def _removed_from(self, parts: Sequence[Part]) -> NDArray[np.int64]:
        """Return the removed prints that are in those of the parts that were not replaced."""
        if not len(self.removed):
            return self.removed
        firsts = [part.listed.first for part in self.parts]
        place = np.searchsorted(firsts, self.removed, "right") - 1
        kept = np.array([part in parts for part in self.parts])
        removed: NDArray[np.int64] = self.removed[kept[place]]
        return removed

    @cached_property
    def _stored(self) -> NDArray[np.intp] | None:
        """Places of the prints that were not removed in all segments; None if none was."""
        if not len(self.removed):
            return None
        numbers = np.concatenate([segment.numbers for segment in self.segments])
        return np.flatnonzero(~np.isin(numbers, self.removed))

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """The numbers of the entries, ascending."""
        return self._of_all("numbers")

    @cached_property
    def fingers(self) -> NDArray[np.int64]:
        """The lowest number of an entry of the finger of each entry."""
        lowest = self._of_all("fingers")
        return _renumbered(lowest, self.renumbered) if len(self.renumbered) else lowest

    def _of_all(self, name: str) -> NDArray[np.int64]:
        arrays = [getattr(segment, name) for segment in self.segments]
        whole = np.concatenate([np.empty(0, np.int64), *arrays])
        return whole if self._stored is None else whole[self._stored]

    def places(self, which: NDArray[np.integer]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return for some prints, by their places in `numbers`, segments and places in these."""
        stored = which if self._stored is None else self._stored[which]
        starts = np.cumsum([0, *(part.listed.prints for part in self.parts)])
        segment = np.searchsorted(starts, stored, "right") - 1
        return segment, stored - starts[segment]

    def indices(self, segment: NDArray[np.integer], place: NDArray[np.integer]) -> NDArray[np.intp]:
        """Return the places in `numbers` of prints that were not removed; see `places`."""
        starts = np.cumsum([0, *(part.listed.prints for part in self.parts)])
        stored: NDArray[np.intp] = starts[segment] + place
        return stored if self._stored is None else np.searchsorted(self._stored, stored)


def read_present(
    gallery: GalleryReader, folder: IndexFolder, known: Iterable[Part] = ()
) -> IndexState:
    """Return the index in a folder, less what was removed since; `known` segments are kept.

    Raises FpmatchError if it cannot be used.
    """
    now, listed = gallery.revision(), folder.read_list()
    removals = removals_between(gallery, listed.revision, now)
    if removals is None:
        raise FpmatchError("of another gallery", code="other")
    return IndexState.of_list(listed, folder, known).after(removals, now)


def removals_between(
    gallery: GalleryReader, before: Revision, now: Revision
) -> list[Removal] | None:
    """Return what was removed from a gallery between two revisions; None if that is not known."""
    if before.removals == UNKNOWN:
        return [] if replace(before, last=now.last) == now else None
    return gallery.removals_since(before)


def _renumbered(fingers: NDArray[np.int64], pairs: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the present numbers of fingers, by pairs of one number and the next."""
    following: dict[int, int] = dict(pairs.tolist())
    last: dict[int, int] = {}
    for number in sorted(following, reverse=True):  # the next number is always greater
        following_one = following[number]
        last[number] = last.get(following_one, following_one)
    before = np.array(sorted(last), np.int64)
    now = np.array([last[number] for number in before.tolist()], np.int64)
    place = np.minimum(np.searchsorted(before, fingers), len(before) - 1)
    present: NDArray[np.int64] = np.where(before[place] == fingers, now[place], fingers)
    return present
