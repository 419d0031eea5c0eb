"""Candidates of a search with their entries, from an open gallery."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fpmatch.gallery.identify import identify

if TYPE_CHECKING:
    from fpmatch.gallery.entry import Entry
    from fpmatch.gallery.gallery import Gallery
    from fpmatch.gallery.identify import Identification
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
