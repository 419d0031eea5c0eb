"""Candidates of a search with their entries, from an open gallery."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.gallery.identify import identify
from fpmatch.gallery.identify_fused import identify_fused

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.identify import Identification
    from fpmatch.gallery.identify_fused import FusedIdentification
    from fpmatch.gallery.search import Search
    from fpmatch.minutiae import Template


def identify_entries(
    gallery: Gallery, search: Search, probe: Template, *, by_subject: bool = False, **options: Any
) -> tuple[Identification, list[Entry]]:
    """Identify a probe as `identify` does; return the entries of the candidates, too.

    With `by_subject` each subject is a candidate once. An entry that has been damaged since the
    search was opened is no candidate; it and those that the search has skipped are in
    `gallery.damaged`. Raises the errors of `identify`, and GalleryError if the gallery cannot be
    read.
    """

    def subject_of(number: int) -> str | None:
        entry = gallery.find_entry(number)
        return None if entry is None else entry.label.subject

    gallery.damaged |= search.damaged
    while True:
        skipped = len(gallery.damaged)
        result = identify(
            search,
            probe,
            subject_of=subject_of if by_subject else None,
            skipped=set(gallery.damaged),
            **options,
        )
        entries = [gallery.find_entry(candidate.number) for candidate in result.candidates]
        if len(gallery.damaged) == skipped:
            return result, [entry for entry in entries if entry is not None]


class GallerySubjects:
    """The subjects of an open gallery; damaged entries are skipped."""

    def __init__(self, gallery: Gallery) -> None:
        self._gallery = gallery

    def __len__(self) -> int:
        return self._gallery.subjects()

    def fingers_of(self, numbers: Sequence[int]) -> dict[str, dict[str, list[int]]]:
        """Return the subjects of the entries of some numbers, with all their fingers."""
        found: dict[str, dict[str, list[int]]] = {}
        for entry in self._gallery.entries_of_subjects(numbers):
            fingers = found.setdefault(entry.label.subject, {})
            fingers.setdefault(entry.label.finger, []).append(entry.id)
        return found


def identify_entries_fused(
    gallery: Gallery, search: Search, probes: Sequence[Template], **options: Any
) -> tuple[FusedIdentification, dict[int, Entry]]:
    """Identify probes as `identify_fused` does; return the entries of the candidates by number.

    Damaged entries are treated, and errors raised, as by `identify_entries`.
    """
    gallery.damaged |= search.damaged
    while True:
        skipped = len(gallery.damaged)
        result = identify_fused(
            search, probes, GallerySubjects(gallery), skipped=set(gallery.damaged), **options
        )
        numbers = {f.number for one in result.candidates for f in one.fingers}
        entries = {number: gallery.find_entry(number) for number in sorted(numbers)}
        if len(gallery.damaged) == skipped:
            return result, {n: entry for n, entry in entries.items() if entry is not None}
