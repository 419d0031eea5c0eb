"""Candidates of a search with their entries, from an open gallery."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.errors import GalleryError
from fpmatch.gallery.identify import identify
from fpmatch.gallery.identify_fused import identify_fused

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.identify import Identification
    from fpmatch.gallery.identify_fused import FusedIdentification
    from fpmatch.gallery.prepared_search import Search
    from fpmatch.templates.minutiae import Template


def identify_entries(
    gallery: Gallery, search: Search, probe: Template, *, by_subject: bool = False, **options: Any
) -> tuple[Identification, list[Entry]]:
    """Identify a probe as `identify` does; return the entries of the candidates, too.

    A large gallery is searched as it is now. With `by_subject` each subject is a candidate once.
    An entry that has been removed or damaged since the search was opened is no candidate; the
    damaged ones, and those that the search has skipped, are in `gallery.damaged`. Raises the errors
    of `identify`, and GalleryError if the gallery cannot be read.
    """
    search = search.current(gallery)
    cached = _Entries(gallery, search)

    def subject_of(number: int) -> str | None:
        entry = cached.entry(number)
        return None if entry is None else entry.label.subject

    while True:
        skipped = cached.skipped()
        result = identify(
            search,
            probe,
            subject_of=subject_of if by_subject else None,
            skipped=skipped,
            **options,
        )
        entries = [cached.entry(candidate.number) for candidate in result.candidates]
        if cached.skipped() == skipped:
            return result, [entry for entry in entries if entry is not None]


class _Entries:
    """Entries of an open gallery, and which of those that are searched cannot be read."""

    def __init__(self, gallery: Gallery, search: Search) -> None:
        self._gallery = gallery
        self._removed: set[int] = set()
        self._read: dict[int, Entry | None] = {}
        gallery.damaged |= search.damaged

    def entry(self, number: int) -> Entry | None:
        """Return an entry, read once; None for one that was removed or is damaged."""
        if number not in self._read:
            self._read[number] = self._find(number)
        return self._read[number]

    def _find(self, number: int) -> Entry | None:
        try:
            return self._gallery.find_entry(number)
        except GalleryError as error:
            if error.code != "unknown":
                raise
            self._removed.add(number)
            return None

    def skipped(self) -> set[int]:
        """Return the numbers of entries that were removed or are damaged."""
        return self._removed | self._gallery.damaged.keys()


class GallerySubjects:
    """The subjects of an open gallery; damaged entries are skipped."""

    def __init__(self, gallery: Gallery) -> None:
        self._gallery = gallery

    def __len__(self) -> int:
        return self._gallery.subjects()

    def fingers_of(self, numbers: Sequence[int]) -> dict[str, dict[str, list[int]]]:
        """Return the subjects of the entries of some numbers, with all their fingers."""
        subjects: dict[str, dict[str, list[int]]] = {}
        for entry in self._gallery.entries_of_subjects(numbers):
            fingers = subjects.setdefault(entry.label.subject, {})
            fingers.setdefault(entry.label.finger, []).append(entry.id)
        return subjects


def identify_entries_fused(
    gallery: Gallery, search: Search, probes: Sequence[Template], **options: Any
) -> tuple[FusedIdentification, dict[int, Entry]]:
    """Identify probes as `identify_fused` does; return the entries of the candidates by number.

    Damaged entries are treated, and errors raised, as by `identify_entries`.
    """
    search = search.current(gallery)
    cached = _Entries(gallery, search)
    while True:
        skipped = cached.skipped()
        result = identify_fused(
            search, probes, GallerySubjects(gallery), skipped=skipped, **options
        )
        numbers = {f.number for one in result.candidates for f in one.fingers}
        entries = {number: cached.entry(number) for number in sorted(numbers)}
        if cached.skipped() == skipped:
            return result, {n: entry for n, entry in entries.items() if entry is not None}
